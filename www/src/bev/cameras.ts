import { css, html, LitElement, nothing, type TemplateResult } from 'lit';
import { customElement, property } from 'lit/decorators.js';
import { list } from '../components/list-field.js';
import { shared, small } from '../components/theme.js';
import type {
  BevAxes,
  BevCamera,
  BevIntrinsics,
  BevLayout,
  BevPlane,
  BevPose,
  BevPoseKind,
  BevRole,
  BevScene,
  EulerOrder,
} from './protocol.js';
import { fire } from '../components/fire.js';

const DEGREE = Math.PI / 180;

const AXES: readonly [BevAxes, string][] = [
  ['three_js', 'Three.js: x right, y up, z back'],
  ['opencv', 'OpenCV: x right, y down, z forward'],
  ['habitat', 'Habitat: x right, y up, z back'],
  ['robotics', 'Robotics: x forward, y left, z up'],
  ['ros_optical', 'Robot world, optical cameras'],
];
const ORDERS = (['XYZ', 'YZX', 'ZXY', 'XZY', 'YXZ', 'ZYX'] as const).map((order) => [order, order] as const);
const INTRINSICS = { horizontal: 'horizontal view angle', vertical: 'vertical view angle', focal: 'fx fy cx cy' };
const PLANES: Record<BevPlane['kind'], string> = { level: 'height', tilted: 'normal and offset' };
const KINDS: Record<BevPoseKind, string> = { euler: 'angles', quaternion: 'a quaternion', matrix: 'a 4 × 4 matrix' };
const ROLES: readonly [BevRole, string][] = [
  ['top', 'Top camera'],
  ['front', 'Front camera'],
];

/** How both poses are to be given. */
export interface PoseKindRequest {
  kind: BevPoseKind;
  order: EulerOrder;
}

/**
 * The fields of the cameras and the ground.
 *
 * Fires `scene-changed` with the scene, `axes-chosen` with the axes it is to be given in, and `pose-kind-chosen`
 * (PoseKindRequest): the engine says those numbers.
 */
@customElement('scanstitch-bev-cameras')
export class ScanstitchBevCameras extends LitElement {
  @property({ attribute: false }) scene: BevScene | null = null;
  @property({ attribute: false }) layout: BevLayout | null = null;

  protected override render(): TemplateResult | typeof nothing {
    const { scene } = this;
    if (!scene) return nothing;
    return html`<div class="all">
      <label class="wide"
        >Axes ${list(AXES, scene.axes, (axes) => fire(this, 'axes-chosen', axes), { label: 'Axes' })}</label
      >
      ${ROLES.map(([role, title]) => this.renderCamera(scene[role], role, title))} ${this.renderPlane(scene.plane)}
    </div>`;
  }

  private renderCamera(camera: BevCamera, role: BevRole, title: string): TemplateResult {
    const set = (change: Partial<BevCamera>) => this.change({ [role]: { ...camera, ...change } });
    const found = this.layout?.[role];
    const angle = (radians: number) => `${(radians / DEGREE).toFixed(1)}°`;
    return html`<fieldset>
      <legend>${title}</legend>
      <div class="fields">
        ${this.number(title, 'width (px)', camera.width, (width) => set({ width: Math.round(width) }), 1)}
        ${this.number(title, 'height (px)', camera.height, (height) => set({ height: Math.round(height) }), 1)}
        ${this.renderIntrinsics(camera, title, (intrinsics) => set({ intrinsics }))}
        ${this.renderPose(camera.pose, title, (pose) => set({ pose }))}
      </div>
      ${
        found
          ? html`<p class="muted found">
              ${found.height.toFixed(3)} m above the ground; sees ${angle(found.horizontal_field_of_view)} ×
              ${angle(found.vertical_field_of_view)}; f = ${found.intrinsics[0].toFixed(2)},
              ${found.intrinsics[1].toFixed(2)} px
            </p>`
          : nothing
      }
    </fieldset>`;
  }

  private renderIntrinsics(
    { intrinsics, width, height }: BevCamera,
    title: string,
    set: (intrinsics: BevIntrinsics) => void,
  ): TemplateResult {
    const focal = (): BevIntrinsics => {
      const f = intrinsics.kind === 'field_of_view' ? focalLength(intrinsics, width, height) : intrinsics.fx;
      return { kind: 'focal', fx: f, fy: f, cx: width / 2, cy: height / 2 };
    };
    const view = (side: 'horizontal' | 'vertical'): BevIntrinsics => {
      const f = intrinsics.kind === 'focal' ? intrinsics.fx : focalLength(intrinsics, width, height);
      const size = side === 'horizontal' ? width : height;
      return { kind: 'field_of_view', field_of_view: 2 * Math.atan(size / 2 / f), side };
    };
    const now = intrinsics.kind === 'focal' ? 'focal' : intrinsics.side;
    return html`<label class="two"
        >Intrinsics
        ${list(INTRINSICS, now, (kind) => set(kind === 'focal' ? focal() : view(kind)), {
          label: `${title}: intrinsics`,
        })}
      </label>
      ${
        intrinsics.kind === 'field_of_view'
          ? this.number(title, 'view angle (°)', intrinsics.field_of_view / DEGREE, (degrees) =>
              set({ ...intrinsics, field_of_view: degrees * DEGREE }),
            )
          : (['fx', 'fy', 'cx', 'cy'] as const).map((name) =>
              this.number(title, `${name} (px)`, intrinsics[name], (value) => set({ ...intrinsics, [name]: value })),
            )
      }`;
  }

  private renderPose(pose: BevPose, title: string, set: (pose: BevPose) => void): TemplateResult {
    const tellKind = (kind: BevPoseKind, order: EulerOrder) => fire(this, 'pose-kind-chosen', { kind, order });
    const order = pose.kind === 'euler' ? pose.order : 'XYZ';
    return html`<label class="two"
        >Pose by ${list(KINDS, pose.kind, (kind) => tellKind(kind, order), { label: `${title}: pose by` })}
      </label>
      ${
        pose.kind === 'euler'
          ? html`<label
              >order
              ${list(ORDERS, order, (name) => tellKind('euler', name), {
                label: `${title}: Euler order`,
                hint: 'XYZ is R = Rx Ry Rz, as in Three.js; roll, pitch, yaw is ZYX',
              })}
            </label>`
          : nothing
      }
      ${pose.kind === 'matrix' ? this.renderMatrix(pose, title, set) : this.renderPosition(pose, title, set)}`;
  }

  private renderPosition(
    pose: Exclude<BevPose, { kind: 'matrix' }>,
    title: string,
    set: (pose: BevPose) => void,
  ): TemplateResult {
    const axes = ['x', 'y', 'z'] as const;
    return html`${axes.map((axis, index) =>
      this.number(title, `${axis} (m)`, pose.position[index] ?? 0, (value) =>
        set({ ...pose, position: replaced(pose.position, index, value) }),
      ),
    )}
    ${
      pose.kind === 'euler'
        ? axes.map((axis, index) =>
            this.number(title, `about ${axis} (°)`, (pose.angles[index] ?? 0) / DEGREE, (degrees) =>
              set({ ...pose, angles: replaced(pose.angles, index, degrees * DEGREE) }),
            ),
          )
        : (['qx', 'qy', 'qz', 'qw'] as const).map((name) =>
            this.number(title, name, pose[name], (value) => set({ ...pose, [name]: value })),
          )
    }`;
  }

  private renderMatrix(
    { T_world_camera: rows }: Extract<BevPose, { kind: 'matrix' }>,
    title: string,
    set: (pose: BevPose) => void,
  ): TemplateResult {
    const text = rows.map((row) => row.map((value) => String(Number(value.toPrecision(12)))).join(' ')).join('\n');
    const read = (event: Event) => {
      const area = event.target as HTMLTextAreaElement;
      const numbers = area.value
        .split(/[\s,;[\]]+/)
        .filter((word) => word !== '')
        .map(Number);
      const isWhole = numbers.length === 16 && numbers.every(Number.isFinite);
      area.setCustomValidity(isWhole ? '' : 'A matrix has sixteen numbers, four on each line');
      area.reportValidity();
      if (!isWhole) return;
      const row = (i: number) => numbers.slice(4 * i, 4 * i + 4) as [number, number, number, number];
      set({ kind: 'matrix', T_world_camera: [row(0), row(1), row(2), row(3)] });
    };
    return html`<label class="wide"
      >T_world_camera
      <textarea
        aria-label="${title}: T_world_camera"
        rows="4"
        spellcheck="false"
        .value=${text}
        @change=${read}
      ></textarea>
    </label>`;
  }

  private renderPlane(plane: BevPlane): TemplateResult {
    const set = (changed: BevPlane) => this.change({ plane: changed });
    const up = this.layout?.up ?? [0, 1, 0];
    const choose = (kind: BevPlane['kind']) => {
      const { height } = plane.kind === 'level' ? plane : { height: plane.offset };
      set(kind === 'level' ? { kind, height } : { kind, normal: up, offset: height });
    };
    const title = 'Ground';
    return html`<fieldset>
      <legend>${title}</legend>
      <div class="fields">
        <label class="two">Given by ${list(PLANES, plane.kind, choose, { label: 'Ground: given by' })}</label>
        ${
          plane.kind === 'level'
            ? this.number(title, 'height (m)', plane.height, (height) => set({ ...plane, height }))
            : html`${(['normal x', 'normal y', 'normal z'] as const).map((name, index) =>
                this.number(title, name, plane.normal[index] ?? 0, (value) =>
                  set({ ...plane, normal: replaced(plane.normal, index, value) }),
                ),
              )}
              ${this.number(title, 'offset (m)', plane.offset, (offset) => set({ ...plane, offset }))}`
        }
      </div>
    </fieldset>`;
  }

  private number(
    title: string,
    label: string,
    value: number,
    set: (value: number) => void,
    step: number | 'any' = 'any',
  ): TemplateResult {
    const read = (event: Event) => {
      const field = event.target as HTMLInputElement;
      const number = Number(field.value);
      const isNumber = field.value.trim() !== '' && Number.isFinite(number);
      field.setCustomValidity(isNumber ? '' : 'Give a decimal number');
      if (isNumber) set(number);
    };
    return html`<label
      >${label}
      <input
        type="number"
        step=${step}
        aria-label="${title}: ${label}"
        .value=${String(Number(value.toPrecision(10)))}
        @change=${read}
      />
    </label>`;
  }

  private change(change: Partial<BevScene>): void {
    fire(this, 'scene-changed', { ...this.scene, ...change });
  }

  static override styles = [
    shared,
    css`
      .all {
        display: grid;
        gap: 10px;
      }
      fieldset {
        min-width: 0;
        margin: 0;
        padding: 6px 10px 10px;
        border: 1px solid var(--line);
        border-radius: 7px;
      }
      legend {
        padding: 0 4px;
        font-weight: 600;
      }
      .fields {
        display: grid;
        grid-template-columns: repeat(3, minmax(0, 1fr));
        gap: 6px 8px;
      }
      label {
        display: grid;
        gap: 2px;
        ${small};
      }
      .two {
        grid-column: 1 / span 2;
      }
      .wide {
        grid-column: 1 / -1;
      }
      input,
      select,
      textarea {
        width: 100%;
        min-width: 0;
        color: var(--text);
        font-size: calc(13 * var(--px));
        font-variant-numeric: tabular-nums;
      }
      textarea {
        padding: 4px 6px;
        font-family: var(--mono);
        font-size: calc(12 * var(--px));
        white-space: pre;
        resize: vertical;
      }
      .found {
        margin-top: 6px;
        font-size: calc(12 * var(--px));
      }
    `,
  ];
}

function focalLength(
  { field_of_view, side }: Extract<BevIntrinsics, { kind: 'field_of_view' }>,
  width: number,
  height: number,
): number {
  return (side === 'horizontal' ? width : height) / 2 / Math.tan(field_of_view / 2);
}

function replaced(values: readonly number[], index: number, value: number): [number, number, number] {
  const copy: [number, number, number] = [values[0] ?? 0, values[1] ?? 0, values[2] ?? 0];
  copy[index] = value;
  return copy;
}
