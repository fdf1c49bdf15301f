"""An aerial-aquatic manipulator with two arms, one in front and one behind."""
