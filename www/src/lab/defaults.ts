/** The engine's own defaults of the options that the form shows; the engine has more options, which stay as they are. */
export const DEFAULTS = {
  max_correspondence_distance: 0.5,
  max_normal_angle: Math.PI / 4,
  trim_fraction: 0,
  robust_kernel: 'cauchy',
  robust_kernel_width: 0.05,
  max_iterations: 50,
} as const;

export const SPATIAL_DEFAULTS = { voxel_size: 0 } as const;
export const PLANAR_DEFAULTS = { search_translation: 0, search_rotation: 0 } as const;
