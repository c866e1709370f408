"""What the book's pages need: the ledger of claims, and its figures."""
