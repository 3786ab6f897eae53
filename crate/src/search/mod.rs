//! Nearest-neighbour indices, each tested against brute force.
