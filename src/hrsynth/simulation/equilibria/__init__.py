"""Every ending of the loop: the poses at which it can rest, which of them attract, and from where."""
