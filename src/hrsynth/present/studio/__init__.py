"""The page to work in: a server on this machine, a robot of its own for each tab, and what its panels are answered."""
