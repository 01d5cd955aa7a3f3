"""Selection of legs to observe for one displacement: modes, aspects, visibility, accuracy and a simulated run of each
set."""
