"""What a figure that computes in a page shows."""


def at_work(page, figure):
    """Wait until a figure has drawn itself."""
    page.wait_for_selector(f"[data-figure={figure}] .stage[data-ready]")


def told(page, figure, key):
    """A number that a figure shows."""
    selector = f"[data-figure={figure}] .stage"
    return float(page.evaluate(f"document.querySelector('{selector}').dataset.{key}"))


def settled(page):
    """Wait for the drawing that an input asked for."""
    page.evaluate("() => new Promise(done => requestAnimationFrame(() => setTimeout(done, 50)))")
