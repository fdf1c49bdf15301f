"""The workshop that makes the URDFs and meshes of the robots here: pieces, links, files."""
