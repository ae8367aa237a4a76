"""MJCF files: parsing, default classes, compilation by MuJoCo, meshes that give no mass."""
