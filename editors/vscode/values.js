// Shows the values of a running control, or of a record at a tick, beside the names of its program, and sets and forces
// variables of a control after a question.

const slider = require('./slider');

/** How often the values of a running control are fetched, in milliseconds. */
const PERIOD = 1000;

/** Adds the commands. `ask` sends a request to the language server. */
function register(vscode, ask) {
  /** What is shown: the document, the path of the run, and what the server said of it. */
  let shown;
  let timer;
  const bar = vscode.window.createStatusBarItem(vscode.StatusBarAlignment.Left, 10);
  const answers = vscode.window.createOutputChannel('plcc: why');
  /** Says of what values are shown, so that VS Code offers what can be done with it: `control`, `record` or nothing. */
  const setContext = async (what) => {
    await vscode.commands.executeCommand('setContext', 'plcc.showsValues', what !== undefined);
    await vscode.commands.executeCommand('setContext', 'plcc.showsRecord', what === 'record');
  };

  const hide = async () => {
    clearInterval(timer);
    shown = undefined;
    bar.hide();
    setContext(undefined);
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
    if (!shown.isLive) {
      time.update(shown);
    }
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
      setContext(shown.isLive ? 'control' : 'record');
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

  const time = slider.register(vscode, goTo);

  /** The name of a variable: the one at the cursor, unless another one is written. */
  const askName = (title) => {
    const editor = vscode.window.activeTextEditor;
    const range = editor && editor.document.getWordRangeAtPosition(editor.selection.active);
    return vscode.window.showInputBox({ title, value: range ? editor.document.getText(range) : '' });
  };

  /** Says why a variable has its value in the tick that is shown. */
  const why = async (variable) => {
    const name = variable || await askName('Why has which variable its value?');
    if (!name) {
      return;
    }
    try {
      const { text } = await ask('plcc/why', { name });
      // The text ends its last line itself, so that a blank line follows.
      answers.appendLine(text);
      answers.show(true);
    } catch (error) {
      vscode.window.showErrorMessage(error.message);
    }
  };

  /** Sets or forces a variable of the control, or ends a force, after a question. */
  const change = async (force, hasValue) => {
    if (!shown || !shown.isLive) {
      vscode.window.showWarningMessage('Show the values of a running control first: what is past can\'t be changed.');
      return;
    }
    const name = await askName('Which variable?');
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
    answers,
    time.disposable,
    { dispose: () => clearInterval(timer) },
    command('showValues', begin),
    command('hideValues', hide),
    command('valuesBack', () => shown && goTo(shown.tick - 1)),
    command('valuesForward', () => shown && goTo(shown.tick + 1)),
    command('valuesGoTo', askTick),
    command('why', why),
    command('setVariable', () => change(false, true)),
    command('forceVariable', () => change(true, true)),
    command('unforceVariable', () => change(true, false)),
  );
}

module.exports = { register };
