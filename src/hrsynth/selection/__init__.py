"""Which legs to watch for one displacement: every set held against modes, aspects, sight, accuracy and a servo run."""
