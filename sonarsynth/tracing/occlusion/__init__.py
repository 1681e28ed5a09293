"""Who is hidden from whom: by each ray and for each sensor."""
