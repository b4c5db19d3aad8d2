// A slider through the ticks of a record, as a view beside the files.

/** What the view shows: the ticks of the record, from the first to the last. It sends the tick that is chosen. */
const PAGE = `<!DOCTYPE html>
<html><head><meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'">
<style>body { padding: 0.5em; } input { width: 100%; } label { display: block; }</style></head>
<body><label for="tick">PAST: tick <output id="shown"></output> of <output id="ticks"></output></label>
<input id="tick" type="range" step="1">
<script>
const editor = acquireVsCodeApi();
const [slider, shown, ticks] = ['tick', 'shown', 'ticks'].map((id) => document.getElementById(id));
slider.addEventListener('input', () => {
  shown.textContent = slider.value;
  editor.postMessage({ tick: Number(slider.value) });
});
window.addEventListener('message', ({ data }) => {
  [slider.min, slider.max, slider.value] = [data.first, data.last, data.tick];
  shown.textContent = data.tick;
  ticks.textContent = data.first + ' to ' + data.last;
});
editor.postMessage({ ready: true });
</script></body></html>`;

/** Adds the view. `goTo` shows a tick. Returns what is to be disposed of, and `update`, which takes the tick that is shown. */
function register(vscode, goTo) {
  let view;
  let shown;
  // The slider gives ticks faster than they can be shown: of those that come meanwhile the last one counts.
  let wanted;
  let isBusy = false;
  const follow = async (tick) => {
    wanted = tick;
    while (!isBusy && wanted !== undefined) {
      const next = wanted;
      wanted = undefined;
      isBusy = true;
      await goTo(next);
      isBusy = false;
    }
  };
  const send = () => view && shown && view.webview.postMessage(shown);
  const provider = {
    resolveWebviewView(resolved) {
      view = resolved;
      view.webview.options = { enableScripts: true };
      view.webview.onDidReceiveMessage(({ tick, ready }) => (ready ? send() : follow(tick)));
      view.onDidDispose(() => { view = undefined; });
      view.webview.html = PAGE;
    },
  };
  return {
    disposable: vscode.window.registerWebviewViewProvider('plcc.time', provider),
    update: ({ tick, first, last }) => {
      shown = { tick, first, last };
      // While it is moved, it stays where the hand is.
      if (wanted === undefined) {
        send();
      }
    },
  };
}

module.exports = { register };
