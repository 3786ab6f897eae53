/** Depth images and clouds in space: what the page and its workers say to each other. */
import type { IterationRecord, Problem } from './protocol.js';
import type { SettingField, SettingPreset } from '../components/settings-panel.js';

export interface SpatialPose {
  x: number;
  y: number;
  z: number;
  qx: number;
  qy: number;
  qz: number;
  qw: number;
}

export interface SpatialFrameResult {
  name: string;
  T_world_sensor: SpatialPose;
  status: 'good' | 'doubtful' | 'lost';
  reason: string;
  agreement: number;
  overlap: number;
  num_correspondences: number;
  num_inliers: number;
  fitness: number;
  inlier_rmse: number;
  iterations: number;
  converged: boolean;
  history: IterationRecord[];
}

export interface SpatialComparison {
  name: string;
  num_matched: number;
  mean: number;
  rmse: number;
  max: number;
  errors: (number | null)[];
  rotation_errors: (number | null)[];
  reference: (SpatialPose | null)[];
  convention: string;
}

export interface SpatialCamera {
  width: number;
  height: number;
  fx: number;
  fy: number;
  cx: number;
  cy: number;
}

export type SpatialSettings = Record<string, string | number>;

export interface SpatialResult {
  version: string;
  settings: SpatialSettings;
  camera: SpatialCamera | null;
  depth_scale: number | null;
  quantisation: 'truncated' | 'rounded' | null;
  frames: SpatialFrameResult[];
  comparison: SpatialComparison | null;
  notes: string[];
}

export interface MapSize {
  voxel_size: number;
  num_points: number;
  num_bytes: number;
}

export interface SpatialFacts {
  version: string;
  descriptions: SettingField[];
  presets: SettingPreset[];
}

export type { Problem };
