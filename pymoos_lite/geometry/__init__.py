"""Points, seglists, polygons, CPA and local x/y to latitude/longitude."""
