"""What makes a site and a PDF of the book, and pictures of it."""
