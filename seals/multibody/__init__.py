"""Equations of motion of a rigid body and of a tree of links, batch axis first."""
