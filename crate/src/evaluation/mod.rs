//! How good a result is: sharpness of the map, distance to a reference.
