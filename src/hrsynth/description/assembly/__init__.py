"""What foreign files leave to do: guesses, loops closed, closures and rounded geometry read as they are meant."""
