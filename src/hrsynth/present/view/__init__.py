"""The 3D view: what is drawn of a robot as plain data, and the page that draws it."""
