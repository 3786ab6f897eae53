import { css, html, LitElement, nothing, type PropertyValues, type TemplateResult } from 'lit';
import { customElement, property, state } from 'lit/decorators.js';
import type { Status } from '../views/map-painter.js';
import { plural } from '../views/format.js';
import { cssColor, frameColor, type Rgb } from '../views/palette.js';
import { slider } from '../components/fields.js';
import { iconButton } from '../components/icon-button.js';
import { row, shared } from '../components/theme.js';
import { fire } from '../components/fire.js';

/** The whole film takes about this long, but no picture is shorter or longer than these. */
const FILM_MS = 5000;
const SHORTEST_MS = 33;
const LONGEST_MS = 600;

/** Each browser has its own name for the track. */
const track = css`
  height: 6px;
  border-radius: 3px;
  background:
    linear-gradient(
      to right,
      transparent var(--filled),
      color-mix(in srgb, var(--surface) 78%, transparent) var(--filled)
    ),
    linear-gradient(to right, var(--stops));
`;

/**
 * The slider that builds the map scan by scan, and plays. Its track is the legend of the colours.
 *
 * Fires `until-changed` with the number of scans to show.
 */
@customElement('scanstitch-timeline')
export class ScanstitchTimeline extends LitElement {
  @property({ type: Number }) count = 0;
  @property({ type: Number }) until = 0;
  @property({ attribute: false }) statuses: readonly Status[] = [];
  /** One for each frame; null: those of time. */
  @property({ attribute: false }) colors: readonly Rgb[] | null = null;
  @property({ type: Boolean }) dark = false;
  /** What is shown one by one: "scan" or "frame". */
  @property() noun = 'scan';
  @state() private isPlaying = false;
  private timer: ReturnType<typeof setInterval> | undefined;

  override disconnectedCallback(): void {
    super.disconnectedCallback();
    this.pause();
  }

  protected override willUpdate(changed: PropertyValues<this>): void {
    if (changed.has('count') && this.count < 2) this.pause();
  }

  protected override render(): TemplateResult {
    const { count, until } = this;
    const isIdle = count < 2;
    const stops = this.colors ? bands(this.colors) : timeStops(this.dark);
    const filled = count > 1 ? ((until - 1) / (count - 1)) * 100 : 100;
    return html`
      ${iconButton(this.isPlaying ? 'pause' : 'play', this.isPlaying ? 'Pause' : `Play: build the map ${this.noun} by ${this.noun}`, this.toggle, { hint: this.isPlaying ? 'Pause' : 'Play', kind: '', isOff: isIdle })}
      <div class="slider" style="--stops: ${stops}; --filled: ${filled}%">
        <div class="marks" aria-hidden="true">
          ${runs(this.statuses).map(({ value, first, last }) =>
            value === 'good' || count < 2
              ? nothing
              : html`<i
                  class=${value}
                  style="left: ${(first / (count - 1)) * 100}%; width: calc(5px + ${((last - first) / (count - 1)) * 100}%)"
                ></i>`,
          )}
        </div>
        ${slider(
          Math.max(until, 1),
          {
            label: this.noun === 'scan' ? 'Scans shown' : 'Frames shown',
            ...{ min: 1, max: Math.max(count, 1), isOff: isIdle },
            words: `${until} of ${plural(count, this.noun)}`,
          },
          (to) => {
            this.pause();
            this.show(to);
          },
        )}
      </div>
      <output class="number" aria-hidden="true">${until}<span class="muted"> / ${count}</span></output>
    `;
  }

  private toggle(): void {
    if (this.isPlaying) {
      this.pause();
      return;
    }
    this.isPlaying = true;
    if (this.until >= this.count) this.show(1);
    const interval = Math.min(Math.max(FILM_MS / this.count, SHORTEST_MS), LONGEST_MS);
    const stride = Math.max(1, Math.round((interval * this.count) / FILM_MS));
    this.timer = setInterval(() => {
      if (this.until >= this.count) this.pause();
      else this.show(Math.min(this.until + stride, this.count));
    }, interval);
  }

  private pause(): void {
    clearInterval(this.timer);
    this.isPlaying = false;
  }

  private show(until: number): void {
    fire(this, 'until-changed', until);
  }

  static override styles = [
    shared,
    css`
      :host {
        ${row};
        gap: 12px;
      }
      .slider {
        position: relative;
        flex: 1;
        min-width: 0;
        ${row};
      }
      input {
        appearance: none;
        width: 100%;
        height: 28px;
        background: transparent;
        cursor: pointer;
      }
      input:disabled {
        cursor: default;
        opacity: 0.5;
      }
      input::-webkit-slider-runnable-track {
        ${track}
      }
      input::-moz-range-track {
        ${track}
      }
      input::-webkit-slider-thumb {
        appearance: none;
        width: 18px;
        height: 18px;
        margin-top: -6px;
        border: 2px solid var(--text);
        border-radius: 50%;
        background: var(--surface);
      }
      input::-moz-range-thumb {
        width: 14px;
        height: 14px;
        border: 2px solid var(--text);
        border-radius: 50%;
        background: var(--surface);
      }
      .marks {
        position: absolute;
        inset: 0 9px auto;
        height: 5px;
      }
      .marks i {
        position: absolute;
        height: 5px;
        margin-left: -2.5px;
        border-radius: 2.5px;
        background: var(--doubtful);
      }
      .marks i.lost {
        background: var(--lost);
      }
      output {
        min-width: 54px;
        text-align: right;
      }
    `,
  ];
}

/** Neighbours that are equal, as one. */
function runs<T>(values: readonly T[]): { value: T; first: number; last: number }[] {
  const found: { value: T; first: number; last: number }[] = [];
  values.forEach((value, at) => {
    const run = found.at(-1);
    if (run && run.value === value) run.last = at;
    else found.push({ value, first: at, last: at });
  });
  return found;
}

/** The stops of a gradient: from the first frame to the last. */
function timeStops(dark: boolean): string {
  return Array.from({ length: 12 }, (_, i) => cssColor(frameColor(i / 11, dark))).join(', ');
}

/** The same with a band for each run of one colour. */
function bands(colors: readonly Rgb[]): string {
  const percent = (frame: number): string => `${((100 * frame) / colors.length).toFixed(2)}%`;
  return runs(colors)
    .map(({ value, first, last }) => `${cssColor(value)} ${percent(first)} ${percent(last + 1)}`)
    .join(', ');
}
