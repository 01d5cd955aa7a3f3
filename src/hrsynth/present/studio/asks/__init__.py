"""One module a question of the studio, found by its name: ``answer`` takes the request and gives plain data."""
