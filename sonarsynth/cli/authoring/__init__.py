"""Commands for authors of recipes: a first recipe, and a look at what it would make."""
