// A figure opens in its own size, by a click, a tap or the Enter key, and closes by the same or by Escape.
(function () {
  "use strict";
  function begin() {
    const images = document.querySelectorAll(".bd-article .cell_output img, .bd-article figure img:not(.sd-card-img-top)");
    if (!images.length) return;
    const dialog = document.createElement("dialog");
    dialog.className = "enlarged";
    dialog.setAttribute("aria-label", "figure in its own size");
    dialog.addEventListener("click", () => dialog.close());
    dialog.addEventListener("keydown", (event) => { if (event.key === "Escape") dialog.close(); }); // a theme's own handler may keep the browser's from it
    document.body.append(dialog);
    for (const image of images) {
      const open = () => {
        const large = new Image();
        large.src = image.currentSrc || image.src;
        large.alt = image.alt;
        dialog.classList.toggle("lines", !image.classList.contains("picture"));
        dialog.replaceChildren(large);
        dialog.showModal();
      };
      image.tabIndex = 0;
      image.setAttribute("role", "button");
      image.title = "enlarge";
      image.addEventListener("click", open);
      image.addEventListener("keydown", (event) => { if (event.key === "Enter") open(); });
    }
  }
  if (document.readyState === "loading") document.addEventListener("DOMContentLoaded", begin);
  else begin();
})();
