//! Files to points and trajectories, and back.
