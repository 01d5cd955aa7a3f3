"""All poses of a platform whose tips are confined to points, lines and circles: counted, enclosed and proved."""
