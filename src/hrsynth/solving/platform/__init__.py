"""All poses of a platform on loci of its tips, or under conditions: proposed, enclosed, counted and bounded."""
