/** The options of a method as a form shows them, and methods that a course compares. */
import type { SettingField, SettingPreset, SettingValues } from '../run/settings-panel.js';
import { DEFAULTS, PLANAR_DEFAULTS, SPATIAL_DEFAULTS } from './defaults.js';
import type { CloudMetric, Options } from './protocol.js';
import { KERNELS, metricName, metricsFor } from './words.js';

type FieldText = Pick<SettingField, 'name' | 'label' | 'explanation' | 'kind'> & { unit?: 'm' | 'rad'; group?: string };

function fields(is_planar: boolean): readonly FieldText[] {
  const metrics = metricsFor(is_planar).map((value) => ({ value, label: metricName(value) }));
  const kernels = Object.entries(KERNELS).map(([value, label]) => ({ value, label }));
  return [
    {
      name: 'metric',
      label: 'Error metric',
      explanation:
        'The residual of a pair: the distance between its two points, or from the point to the surface at its partner.',
      kind: { type: 'choice', choices: metrics },
    },
    {
      name: 'max_correspondence_distance',
      label: 'Largest pair distance',
      explanation: 'Pairs further apart are rejected as too far.',
      unit: 'm',
      kind: { type: 'number', min: 0.001, max: 100, step: 0.05 },
    },
    {
      name: 'max_normal_angle',
      label: 'Largest normal angle',
      explanation: 'Pairs whose normals differ by more are rejected; 180° accepts all.',
      unit: 'rad',
      kind: { type: 'number', min: 0, max: Math.PI, step: Math.PI / 36 },
    },
    {
      name: 'trim_fraction',
      label: 'Trimmed share',
      explanation: 'This share of the pairs, those with the largest residuals, is rejected (trimmed ICP).',
      kind: { type: 'number', min: 0, max: 0.95, step: 0.05 },
    },
    {
      name: 'robust_kernel',
      label: 'Robust kernel',
      explanation: 'How the weight of a pair falls as its residual grows.',
      kind: { type: 'choice', choices: kernels },
    },
    {
      name: 'robust_kernel_width',
      label: 'Kernel width',
      explanation: 'The residual from which the weight falls.',
      unit: 'm',
      kind: { type: 'number', min: 0.001, max: 10, step: 0.01 },
    },
    {
      name: 'max_iterations',
      label: 'Iteration limit',
      explanation: 'The loop ends earlier when a step is below 0.1 mm and 0.1 mrad.',
      kind: { type: 'integer', min: 1, max: 500 },
    },
    ...(is_planar
      ? [
          {
            name: 'search_translation',
            label: 'Search in x and y',
            explanation: 'Half width of a correlative search for the start, in x and y; 0 starts where the clouds lie.',
            unit: 'm' as const,
            kind: { type: 'number' as const, min: 0, max: 20, step: 0.5 },
          },
          {
            name: 'search_rotation',
            label: 'Search in heading',
            explanation: 'Half width of that search in heading.',
            unit: 'rad' as const,
            kind: { type: 'number' as const, min: 0, max: Math.PI, step: Math.PI / 36 },
          },
        ]
      : [
          {
            name: 'voxel_size',
            label: 'Voxel size',
            explanation: 'Both clouds are thinned to one point in each voxel; 0 uses all points.',
            unit: 'm' as const,
            kind: { type: 'number' as const, min: 0, max: 5, step: 0.05 },
          },
        ]),
  ];
}

export function methodFields(is_planar: boolean): SettingField[] {
  return fields(is_planar).map((field): SettingField => ({ unit: '', ...field, group: 'Method' }));
}

/** Every option that the form shows. `metric`: what these clouds are registered by where the options name none. */
export function methodValues(
  options: Options,
  is_planar: boolean,
  metric: CloudMetric = is_planar ? 'point_to_line' : 'point_to_plane',
): SettingValues {
  const known = Object.fromEntries(
    Object.entries(options).filter(([, value]) => value !== null && value !== undefined),
  );
  return { metric, ...DEFAULTS, ...(is_planar ? PLANAR_DEFAULTS : SPATIAL_DEFAULTS), ...(known as SettingValues) };
}

/** Options that a link or a session carries: all that the form shows. */
export const optionsOf = (values: SettingValues): Options => ({ ...values }) as Options;

export function methodPresets(is_planar: boolean): SettingPreset[] {
  const preset = (name: string, label: string, explanation: string, changed: Options): SettingPreset => ({
    name,
    label,
    explanation,
    settings: methodValues(changed, is_planar),
  });
  const plain = { robust_kernel: 'none', max_normal_angle: Math.PI } as const;
  const surface = is_planar ? 'point_to_line' : 'point_to_plane';
  return [
    preset('default', `Robust ${metricName(surface).toLowerCase()}`, 'Cauchy kernel, rejection by normals', {}),
    preset(
      'textbook',
      'Textbook ICP',
      'Besl and McKay 1992: point to point, all pairs within reach, closed form by SVD',
      {
        metric: 'point_to_point',
        ...plain,
      },
    ),
    preset(
      'surface',
      `Plain ${metricName(surface).toLowerCase()}`,
      'Chen and Medioni 1992: least squares, Gauss-Newton',
      {
        metric: surface,
        ...plain,
      },
    ),
    preset('trimmed', 'Trimmed ICP', 'Chetverikov et al. 2002: the worst 30 % of the pairs are dropped', {
      metric: 'point_to_point',
      ...plain,
      trim_fraction: 0.3,
    }),
    preset('tukey', 'Tukey kernel', 'Pairs beyond the width of the kernel have no weight at all', {
      robust_kernel: 'tukey',
      robust_kernel_width: 0.2,
    }),
    ...(is_planar
      ? []
      : [preset('gicp', 'GICP', 'Segal et al. 2009: planes on both sides', { metric: 'gicp', robust_kernel: 'none' })]),
  ];
}
