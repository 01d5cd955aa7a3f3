"""The catalog of architectures: words, the mechanisms they stand for, proved verdicts, and where these are kept."""
