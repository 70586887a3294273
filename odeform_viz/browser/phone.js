// On a phone the controls are a sheet at the bottom: as wide as the screen, and folded until its bar is tapped.
const SHEET = '.mantine-Paper-root[style*="position: fixed"][style*="bottom: 0px"]';
const BAR = `${SHEET} [style*="cursor: pointer"][style*="height: 3.5em"]`;
const style = document.createElement("style");
style.textContent = `
  ${SHEET}, ${SHEET} .mantine-ScrollArea-content > div { width: 100% !important; }
  ${BAR}::before {
    content: ""; position: absolute; top: 0.35em; left: 50%; width: 2.6em; height: 0.25em; margin-left: -1.3em;
    border-radius: 1em; background: currentColor; opacity: 0.3;
  }`;
document.head.append(style);

const mounted = new MutationObserver(() => {
  const bar = document.querySelector(BAR);
  if (!bar) return;
  mounted.disconnect();
  bar.click();
});
if (matchMedia("(max-width: 36em)").matches) mounted.observe(document.body, { childList: true, subtree: true });
