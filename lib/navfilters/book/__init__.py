"""What the book's pages need: the ledger of claims, figures, and numbers in words."""

from navfilters.book.printing import three_digits

__all__ = ["three_digits"]
