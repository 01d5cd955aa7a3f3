"""Files of other tools: one module a dialect turns a file into a joint graph, ``build`` makes a mechanism of it."""
