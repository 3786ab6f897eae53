/** What a newcomer reads above the sample: what the page does, how to begin, what its tools are for, how to embed it. */
import { css, html, type TemplateResult } from 'lit';
import { icon } from './icons.js';

/** The tools beside the map; the id says what opens them. */
const TOOLS: readonly { id: string; label: string; about: string }[] = [
  { id: 'view:icp', label: 'ICP', about: 'Step through one registration, from any start' },
  { id: 'view:evaluation', label: 'Evaluate', about: 'Errors of trajectories against ground truth' },
  { id: 'view:bev', label: 'Bird’s-eye view', about: 'Points of a top view in a camera’s image' },
  { id: 'view:strategies', label: 'Strategies', about: 'Ways to keep a map: memory, time, accuracy' },
];

/** What a host page writes. */
const EMBED = `<script type="module" src="scanstitch/scanstitch-app.js"></script>
<scanstitch-app src="scans/homework.json" style="height: 80vh"></scanstitch-app>`;

export interface WelcomeHooks {
  /** Told the id of what is to be opened. */
  want(id: string): void;
  /** The lines to embed the page were to be copied. */
  copy(text: string): void;
  close(): void;
}

/** `styles`: welcome_styles. */
export function welcome({ want, copy, close }: WelcomeHooks): TemplateResult {
  return html`<section class="welcome" aria-label="About">
    <div class="what">
      <h1>Laser scans and depth images to a path and a map</h1>
      <p>
        <strong>Drop files anywhere on this page</strong>: scans, depth images, point clouds, a folder, a zip or a ROS
        bag. Everything is computed in this tab; nothing leaves your machine.
      </p>
      <p class="begin">
        <button class="primary" @click=${() => want('files')}>${icon('open')}Choose files…</button>
        <button @click=${() => want('folder')}>Folder…</button>
      </p>
    </div>
    <ul class="tools" aria-label="Tools">
      <li>
        <strong>Map</strong>
        <span
          >The sensor’s path and the stitched map. Shown: ten laser scans.
          <button class="link" @click=${() => want('apartment')}>Depth images</button></span
        >
      </li>
      ${TOOLS.map(
        ({ id, label, about }) =>
          html`<li>
            <button class="link" @click=${() => want(id)}>${label}</button>
            <span>${about}</span>
          </li>`,
      )}
    </ul>
    <details>
      <summary>Embed it in your page</summary>
      <pre tabindex="0" aria-label="Lines to embed the page">${EMBED}</pre>
      <button @click=${() => copy(EMBED)}>Copy</button>
    </details>
    <button class="quiet icon close" aria-label="Close the introduction" title="Close" @click=${close}>
      ${icon('close')}
    </button>
  </section>`;
}

export const welcome_styles = css`
  .welcome {
    position: relative;
    display: grid;
    grid-template-columns: minmax(0, 5fr) minmax(0, 9fr);
    gap: 10px 28px;
    flex: none;
    padding: 14px 48px 12px 16px;
    border-bottom: 1px solid var(--line);
    background: var(--surface);
  }
  .welcome h1 {
    margin: 0 0 4px;
    font-size: 17px;
    font-weight: 680;
    letter-spacing: -0.012em;
    line-height: 1.25;
  }
  .welcome .what p {
    max-width: 62ch;
    font-size: 13px;
    text-wrap: pretty;
  }
  .welcome .begin {
    display: flex;
    gap: 8px;
    padding-top: 10px;
  }
  .welcome .tools {
    display: grid;
    grid-template-columns: repeat(5, minmax(0, 1fr));
    align-content: start;
    gap: 8px;
    font-size: 12.5px;
  }
  .welcome li {
    padding: 8px 10px;
    border: 1px solid var(--line);
    border-radius: var(--radius);
    background: var(--sunken);
    line-height: 1.35;
  }
  .welcome li > :first-child {
    display: block;
    min-height: 22px;
    font-size: 13.5px;
    font-weight: 620;
    text-align: left;
  }
  .welcome li span {
    color: var(--muted);
  }
  .welcome li span button {
    display: inline;
    white-space: nowrap;
  }
  .welcome details {
    grid-column: 2;
    font-size: 12.5px;
  }
  .welcome summary {
    width: max-content;
    color: var(--accent);
    cursor: pointer;
  }
  .welcome pre {
    overflow: auto;
    margin: 8px 0;
    padding: 8px 10px;
    border: 1px solid var(--line);
    border-radius: var(--radius);
    background: var(--sunken);
    font: 12px/1.5 var(--mono);
  }
  .welcome .close {
    position: absolute;
    top: 8px;
    right: 8px;
    color: var(--muted);
  }
  .medium .welcome {
    grid-template-columns: minmax(0, 1fr);
  }
  .medium .welcome details,
  .narrow .welcome details {
    grid-column: 1;
  }
  .narrow .welcome {
    grid-template-columns: minmax(0, 1fr);
    gap: 8px;
    max-height: 52%;
    padding: 10px 12px;
    overflow: auto;
  }
  .narrow .welcome h1 {
    padding-right: 36px;
    font-size: 15.5px;
  }
  .narrow .welcome .begin {
    padding-top: 8px;
  }
  .narrow .welcome .tools {
    display: block;
    border-top: 1px solid var(--line);
  }
  .narrow .welcome li {
    display: flex;
    align-items: baseline;
    gap: 8px;
    padding: 4px 0;
    border: 0;
    border-bottom: 1px solid var(--line);
    border-radius: 0;
    background: none;
  }
  .narrow .welcome li > :first-child {
    flex: none;
    min-width: 76px;
  }
`;
