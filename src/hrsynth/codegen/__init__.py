"""Code for controllers: what the motors' coordinates decide, as functions in other languages."""
