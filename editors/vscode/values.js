// Shows the values of a running control, or of a record at a tick, beside the names of its program, and sets and forces
// variables of a control after a question.

/** How often the values of a running control are fetched, in milliseconds. */
const PERIOD = 1000;

/** Adds the commands. `ask` sends a request to the language server. */
function register(vscode, ask) {
  /** What is shown: the document, the path of the run, and what the server said of it. */
  let shown;
  let timer;
  const bar = vscode.window.createStatusBarItem(vscode.StatusBarAlignment.Left, 10);
  const setContext = (is) => vscode.commands.executeCommand('setContext', 'plcc.showsValues', is);

  const hide = async () => {
    clearInterval(timer);
    shown = undefined;
    bar.hide();
    setContext(false);
    await ask('plcc/hideValues', {});
  };

  /** Shows a tick, the last one if none is named. */
  const show = async (tick) => {
    const { uri, run } = shown;
    const of = await ask('plcc/showValues', { textDocument: { uri }, run, tick });
    if (!shown) {
      return;
    }
    Object.assign(shown, of);
    bar.text = shown.isLive ? `$(pulse) tick ${of.tick}` : `$(history) PAST: tick ${of.tick} of ${of.first} to ${of.last}`;
    bar.tooltip = `Values of ${run}`;
    bar.command = shown.isLive ? 'plcc.hideValues' : 'plcc.valuesGoTo';
    bar.show();
  };

  const begin = async () => {
    const editor = vscode.window.activeTextEditor;
    if (!editor) {
      return;
    }
    const [picked] = (await vscode.window.showOpenDialog({
      title: 'Values of which run? A record, or the socket of a control',
      openLabel: 'Show values',
    })) || [];
    if (!picked) {
      return;
    }
    clearInterval(timer);
    shown = { uri: editor.document.uri.toString(), run: picked.fsPath };
    try {
      await show(null);
      // Of a control that runs only the present can be shown.
      shown.isLive = shown.first === shown.last;
      setContext(true);
      if (shown.isLive) {
        await show(null);
        timer = setInterval(() => show(null).catch(async (error) => {
          await hide();
          vscode.window.showWarningMessage(`The values are not shown any more: ${error.message}`);
        }), PERIOD);
      }
    } catch (error) {
      shown = undefined;
      vscode.window.showErrorMessage(error.message);
    }
  };

  /** Goes to another tick of a record. */
  const goTo = async (tick) => {
    if (!shown || shown.isLive) {
      return;
    }
    try {
      await show(Math.min(Math.max(tick, shown.first), shown.last));
    } catch (error) {
      vscode.window.showErrorMessage(error.message);
    }
  };

  const askTick = async () => {
    if (!shown || shown.isLive) {
      return;
    }
    const text = await vscode.window.showInputBox({
      title: 'Show the values of a tick',
      prompt: `From ${shown.first} to ${shown.last}`,
      value: String(shown.tick),
      validateInput: (value) => (/^\d+$/.test(value) ? undefined : 'A whole number is expected'),
    });
    if (text) {
      await goTo(Number(text));
    }
  };

  /** Sets or forces a variable of the control, or ends a force, after a question. */
  const change = async (force, hasValue) => {
    if (!shown || !shown.isLive) {
      vscode.window.showWarningMessage('Show the values of a running control first: what is past can\'t be changed.');
      return;
    }
    const editor = vscode.window.activeTextEditor;
    const range = editor && editor.document.getWordRangeAtPosition(editor.selection.active);
    const word = range ? editor.document.getText(range) : '';
    const name = await vscode.window.showInputBox({ title: 'Which variable?', value: word });
    const value = name && hasValue ? await vscode.window.showInputBox({ title: `${name} =` }) : undefined;
    if (!name || (hasValue && !value)) {
      return;
    }
    const what = hasValue ? `${force ? 'Force' : 'Set'} ${name} = ${value}` : `Unforce ${name}`;
    const yes = await vscode.window.showWarningMessage(
      `${what}?`, { modal: true, detail: `This acts on the machine at ${shown.run}.` }, what);
    if (yes !== what) {
      return;
    }
    try {
      await ask('plcc/change', { name, value, force });
    } catch (error) {
      vscode.window.showErrorMessage(error.message);
    }
  };

  const command = (name, run) => vscode.commands.registerCommand(`plcc.${name}`, run);
  return vscode.Disposable.from(
    bar,
    { dispose: () => clearInterval(timer) },
    command('showValues', begin),
    command('hideValues', hide),
    command('valuesBack', () => shown && goTo(shown.tick - 1)),
    command('valuesForward', () => shown && goTo(shown.tick + 1)),
    command('valuesGoTo', askTick),
    command('setVariable', () => change(false, true)),
    command('forceVariable', () => change(true, true)),
    command('unforceVariable', () => change(true, false)),
  );
}

module.exports = { register };
