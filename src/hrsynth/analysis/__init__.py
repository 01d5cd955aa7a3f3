"""One module per analysis: controllability, hidden robot, legs to observe and so on."""
