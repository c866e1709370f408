"""What the book's pages need: the ledger of claims, figures, tables, and numbers in words."""

from navfilters.book.printing import three_digits
from navfilters.book.tables import table

__all__ = ["table", "three_digits"]
