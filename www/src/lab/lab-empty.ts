/** Before there are clouds: how to open some, and the gallery; and the question of a scene that is open. */
import { html, type TemplateResult } from 'lit';
import { keyed } from 'lit/directives/keyed.js';
import '../components/menu.js';
import { type ActiveSession, emptyView } from '../run/run-parts.js';
import { type OpenedScene, SCENE_ITEMS } from './clouds.js';

export interface EmptyActions {
  choose(): void;
  sample(): void;
  example(name: string): void;
}

/** `styles`: labStyles. */
export function emptyLab(status: ActiveSession, { choose, sample, example }: EmptyActions): TemplateResult {
  return html`<div class="first">
    ${emptyView(
      {
        title: 'Drop two scans or clouds here',
        label: 'No clouds yet',
        about:
          'The ICP lab registers one cloud to another and shows every iteration: which points are paired, what the step ' +
          'solves, and where it ends from another start. PLY or PCD, in the plane or in space. Frames of depth images, logs ' +
          'and bags: open them under Map, then Look inside.',
        choices: [
          { id: 'files', label: 'Choose two files' },
          { id: 'sample', label: 'Two scans of the sample' },
        ],
      },
      status,
      (id) => (id === 'files' ? choose() : sample()),
    )}
    <h2>Ten examples</h2>
    <div class="gallery" role="group" aria-label="Examples">
      ${SCENE_ITEMS.map(
        ({ id, label, detail }) =>
          html`<a
            href="#icp&scene=${id}"
            @click=${(event: Event) => {
              event.preventDefault();
              example(id);
            }}
            ><strong>${label}</strong><span>${detail}</span></a
          >`,
      )}
    </div>
  </div>`;
}

/** The gallery as a menu. */
export function examplesMenu(show: (name: string) => void): TemplateResult {
  return html`<scanstitch-menu
    label="Examples"
    icon="info"
    .items=${SCENE_ITEMS}
    @menu-chosen=${({ detail }: CustomEvent<string>) => show(detail)}
  ></scanstitch-menu>`;
}

/** What a scene asks, with its answer folded. `styles`: labStyles. */
export function question({ text: { title, question, answer, look_at } }: OpenedScene): TemplateResult {
  // Of another scene the answer is folded again.
  const folded = html`<details>
    <summary>Answer</summary>
    <p>${answer}</p>
  </details>`;
  return html`<section class="question" aria-label="Question">
    <p><strong>${title}.</strong> ${question}</p>
    <p class="muted">Look at: ${look_at}</p>
    ${keyed(title, folded)}
  </section>`;
}
