"""Assembly modes: poses of the platform with the same measured values, listed, judged and proved."""
