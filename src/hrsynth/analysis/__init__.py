"""One module a question: what is controllable, which hidden robot a controller moves, which legs must be watched."""
