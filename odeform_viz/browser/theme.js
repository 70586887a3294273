// The page is dark where the system is: it asks the server for the theme by the hot key of a command.
//
// viser's theme is a message, which the server can send to one client. Commands may arrive after this script, so it asks
// until the page has the theme.
const media = matchMedia("(prefers-color-scheme: dark)");
const CODES = { dark: "D", light: "L" };

function ask(left) {
  const theme = media.matches ? "dark" : "light";
  if (document.documentElement.dataset.mantineColorScheme === theme || left === 0) return;
  const key = CODES[theme];
  // it must not bubble: the camera on the document would take it for a key that is held
  const pressed = { key: key.toLowerCase(), code: `Key${key}`, altKey: true, shiftKey: true, bubbles: false };
  document.documentElement.dispatchEvent(new KeyboardEvent("keydown", pressed));
  setTimeout(ask, 500, left - 1);
}

media.addEventListener("change", () => ask(20));
window.odeform.followTheme = () => ask(20); // called at each connection: the server knows nothing of the last one
