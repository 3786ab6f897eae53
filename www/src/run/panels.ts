/** What the panels around the map are made of: loaded with the first one that is unfolded. */
import './frame-table.js';
import './overview.js';
import './settings-panel.js';
