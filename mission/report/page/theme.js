// Light, dark, or as the device is set.

const THEMES = ['auto', 'light', 'dark'];
const listeners = [];

export function onThemeChange(listener) {
  listeners.push(listener);
}

/** The value of a colour variable of style.css, such as "--true". */
export function colour(name) {
  return getComputedStyle(document.documentElement).getPropertyValue(name).trim();
}

function changed() {
  for (const listener of listeners) listener();
}

export function setTheme(theme) {
  if (theme === 'auto')
    delete document.documentElement.dataset.theme;
  else
    document.documentElement.dataset.theme = theme;
  changed();
}

export function nextTheme() {
  const present = document.documentElement.dataset.theme ?? 'auto';
  const next = THEMES[(THEMES.indexOf(present) + 1) % THEMES.length];
  setTheme(next);
  return next;
}

export function followDevice() {
  matchMedia('(prefers-color-scheme: dark)').addEventListener('change', changed);
}
