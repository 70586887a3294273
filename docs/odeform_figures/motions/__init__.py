"""Small data sets of soft bodies in motion, of the kinds that users bring, as folders of mesh frames."""
