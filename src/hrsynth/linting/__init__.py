"""What is wrong, doubtful or lost in robot files: rules by name, each with its mend."""
