"""Tables of pages that the program writes."""
