/** What a newcomer reads above the sample: what the page does, how to begin, what its tools are for, how to embed it. */
import { css, html, type TemplateResult } from 'lit';
import { iconButton } from '../components/icon-button.js';
import { icon } from '../components/icons.js';
import { TOOLS } from '../components/tools.js';
import { heard, wrap } from '../components/theme.js';

/** What a host page writes. */
const EMBED = `<script type="module" src="scanstitch/scanstitch-app.js"></script>
<scanstitch-app src="scans/homework.json" style="height: 80vh"></scanstitch-app>`;

export interface WelcomeHooks {
  /** Opens a tool, a sample, or a dialog for files. */
  want(id: string): void;
  /** Copies the lines that embed the page. */
  copy(text: string): void;
  close(): void;
}

/** `styles`: welcomeStyles. */
export function welcome({ want, copy, close }: WelcomeHooks): TemplateResult {
  return html`<section class="welcome" aria-label="About">
    <div class="what">
      <h1>Laser scans and depth images to a path and a map</h1>
      <p>
        <strong class="by-mouse">Drop files anywhere on this page</strong
        ><strong class="by-hand">Choose files of this device</strong>: scans, depth images, clouds, a folder, a zip or a
        ROS bag. Everything is computed in this tab; nothing leaves your machine.
      </p>
      <div class="begin">
        <button class="primary" @click=${() => want('files')}>${icon('open')}Choose files…</button>
        <button @click=${() => want('folder')}>Folder…</button>
        <details>
          <summary>Embed it in your page</summary>
          <pre tabindex="0" aria-label="Lines to embed the page">${EMBED}</pre>
          <button @click=${() => copy(EMBED)}>Copy</button>
        </details>
      </div>
    </div>
    <ul class="tools" aria-label="Tools">
      <li>
        <strong>Map</strong>
        <span>Path and map of a recording. Here: ten laser scans; ${link('apartment', 'see depth images', want)}</span>
      </li>
      ${TOOLS.filter(({ tool }) => tool !== 'map').map(
        ({ tool, label, about }) =>
          html`<li>
            ${link(`view:${tool}`, label, want)}
            <span>${about}</span>
          </li>`,
      )}
    </ul>
    ${iconButton('close', 'Close the introduction', close, { hint: 'Close', kind: 'quiet close' })}
  </section>`;
}

function link(id: string, label: string, want: WelcomeHooks['want']): TemplateResult {
  const follow = (event: Event): void => {
    event.preventDefault();
    want(id);
  };
  return html`<a href="#" @click=${follow}>${label}</a>`;
}

export const welcomeStyles = css`
  .welcome {
    position: relative;
    display: grid;
    grid-template-columns: minmax(0, 4fr) minmax(0, 6fr);
    gap: 6px 32px;
    flex: none;
    padding: 9px 44px 9px 16px;
    border-bottom: 1px solid var(--line);
    background: var(--surface);
  }
  .welcome h1 {
    margin: 0 0 2px;
    font-size: calc(17 * var(--px));
    font-weight: 680;
    letter-spacing: -0.012em;
    line-height: 1.3;
    text-wrap: balance;
  }
  .welcome .what p {
    max-width: 68ch;
    font-size: calc(13 * var(--px));
    text-wrap: pretty;
  }
  .welcome .begin {
    ${wrap};
    gap: 8px;
    padding-top: 7px;
  }
  .welcome .by-hand {
    display: none;
  }
  @media (pointer: coarse) {
    .welcome .by-mouse {
      display: none;
    }
    .welcome .by-hand {
      display: inline;
    }
  }
  .welcome .tools {
    display: grid;
    grid-template-columns: repeat(6, auto);
    align-content: center;
    gap: 12px;
    font-size: calc(12.5 * var(--px));
  }
  .welcome li {
    line-height: 1.35;
  }
  .welcome li > :first-child {
    display: block;
    min-height: 24px;
    font-size: calc(13.5 * var(--px));
    font-weight: 620;
    text-align: left;
    white-space: nowrap;
  }
  .welcome li > span {
    color: var(--muted);
  }
  .welcome a {
    color: var(--accent);
    text-underline-offset: 2px;
  }
  .welcome details {
    font-size: calc(13 * var(--px));
  }
  .welcome details[open] {
    flex: 1 1 100%;
    min-width: 0;
  }
  .welcome summary {
    width: max-content;
    min-height: 24px;
    padding: 2px 4px;
    color: var(--accent);
  }
  .welcome pre {
    overflow: auto;
    margin: 4px 0 8px;
    padding: 8px 10px;
    border: 1px solid var(--line);
    border-radius: var(--radius);
    background: var(--sunken);
    font: calc(12 * var(--px)) / 1.5 var(--mono);
  }
  .welcome .close {
    position: absolute;
    top: 8px;
    right: 8px;
    color: var(--muted);
  }
  .medium .welcome,
  .narrow .welcome {
    grid-template-columns: minmax(0, 1fr);
  }
  /* The names alone; what they are for is heard, and seen in the header's hints. */
  :is(.medium, .narrow) .welcome .tools {
    display: flex;
    flex-wrap: wrap;
    gap: 0 16px;
  }
  :is(.medium, .narrow) .welcome li > span {
    ${heard};
  }
  .low .welcome {
    display: none;
  }
  .narrow .welcome {
    max-height: 50%;
    padding: 8px 12px 4px;
    overflow: auto;
  }
  .narrow .welcome h1 {
    padding-right: 36px;
    font-size: calc(15 * var(--px));
  }
  .narrow .welcome .what p {
    font-size: calc(12.5 * var(--px));
    line-height: 1.4;
  }
  .narrow .welcome .begin {
    padding-top: 6px;
  }
`;
