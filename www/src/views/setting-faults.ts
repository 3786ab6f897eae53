/** What is wrong with settings that are written as text, in an attribute or an address. */
import type { Settings } from '../engine/protocol.js';
import type { SpatialSettings } from '../engine/spatial-protocol.js';
import { type Field, fromScreen } from './setting-fields.js';

/** One text holds the settings of both kinds of run: those of the other kind are no mistake. */
const PLANAR: Record<keyof Settings, true> = {
  min_range: true,
  max_range: true,
  strategy: true,
  local_map_scans: true,
  matched_scans: true,
  initial_guess: true,
  odometry: true,
  search_translation: true,
  search_rotation: true,
  metric: true,
  max_correspondence_distance: true,
  max_normal_angle: true,
  trim_fraction: true,
  robust_kernel: true,
  robust_kernel_width: true,
  max_iterations: true,
  rotation_eps: true,
  translation_eps: true,
  scan_unit: true,
  laser_direction: true,
  wheel_track: true,
};
const SPATIAL: Record<keyof SpatialSettings, true> = {
  method: true,
  effort: true,
  color: true,
  motion: true,
  fx: true,
  fy: true,
  cx: true,
  cy: true,
  field_of_view: true,
  depth_scale: true,
  cloud_unit: true,
  depth_values: true,
  quantisation: true,
  min_range: true,
  max_range: true,
  max_height: true,
  voxel_size: true,
  metric: true,
  max_correspondence_distance: true,
  global_registration: true,
  loop_closing: true,
  map_voxel_size: true,
  reference_quaternions: true,
  reference_axes: true,
  reference_direction: true,
};

type Description = Field & { name: PropertyKey; kind: { choices?: { value: string }[] } };

/** A sentence for each setting of `text` that is not taken as it is written. */
export function settingFaults(text: string, descriptions: readonly Description[]): string[] {
  return [...new URLSearchParams(text)].flatMap(([name, value]) => {
    const description = descriptions.find((one) => one.name === name);
    if (description) return valueFault(description, value) ?? [];
    return name in PLANAR || name in SPATIAL ? [] : `“${name}” is not a setting`;
  });
}

function valueFault(description: Description, value: string): string | null {
  const { name, kind } = description;
  const given = `${String(name)}=${value}`;
  if (kind.type === 'choice') {
    const choices = kind.choices?.map((choice) => choice.value) ?? [];
    return choices.includes(value) ? null : `“${given}” is not one of ${choices.join(', ')}`;
  }
  const taken = fromScreen({ ...description, unit: '' }, value);
  if (taken === null) return `“${given}” is not a number`;
  return taken === Number(value) ? null : `“${given}” is not within its limits: ${taken} is used`;
}
