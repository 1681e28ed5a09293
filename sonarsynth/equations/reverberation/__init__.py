"""How much sound boundaries and water scatter, how few scatterers may stand for them, and how bright that is."""
