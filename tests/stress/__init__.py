"""The stress suite: random mechanisms over random steps, against closed forms in more digits than doubles have."""
