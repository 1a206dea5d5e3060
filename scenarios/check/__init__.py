"""`vfi check`: what can be said of a scene before it runs. One file a concern; `report` calls them all."""
