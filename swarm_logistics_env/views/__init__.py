"""What a person runs and looks at: the command line and the live view."""
