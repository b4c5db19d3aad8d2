// Opens the monitor of plcc in a terminal beside the programs: of the program in the editor, which then runs here, of a record, or
// of a running control.

const path = require('path');

/** Adds the command. `executable` gives the path of plcc for a folder. */
function register(vscode, executable) {
  /** The files of the program in the editor: those of one download of a PMAC, or the file alone. */
  const filesOf = (uri, folder) => {
    const at = folder ? folder.uri.fsPath : path.dirname(uri.fsPath);
    const downloads = vscode.workspace.getConfiguration('plcc').get('programs') || [];
    const found = downloads.map((files) => files.map((file) => path.resolve(at, file)));
    return found.find((files) => files.includes(uri.fsPath)) || [uri.fsPath];
  };

  const open = (folder, cwd, args) => {
    const location = vscode.TerminalLocation.Editor;
    const options = { name: 'plcc monitor', shellPath: executable(folder), shellArgs: ['monitor', ...args], cwd, location };
    vscode.window.createTerminal(options).show();
  };

  const choose = async () => {
    const editor = vscode.window.activeTextEditor;
    const isProgram = editor && ['pmi', 'nct', 'pmac'].includes(editor.document.languageId);
    const folder = editor && vscode.workspace.getWorkspaceFolder(editor.document.uri);
    const choices = [];
    if (isProgram) {
      const { fsPath } = editor.document.uri;
      const files = filesOf(editor.document.uri, folder);
      const stimulus = fsPath.replace(/\.[^.]*$/, '.csv');
      const isThere = await vscode.workspace.fs.stat(vscode.Uri.file(stimulus)).then(() => true, () => false);
      if (isThere) {
        const description = path.basename(stimulus);
        choices.push({ label: 'Run the program here with its stimulus', description, args: [...files, '--stimulus', stimulus] });
      }
      choices.push({ label: 'Run the program here', description: path.basename(fsPath), args: files });
      choices.push({ label: 'Run the program here with a simulated machine', description: '--simulate', args: [...files, '--', '--simulate'] });
    }
    choices.push({ label: 'Open a record, or the socket of a running control…' });
    const chosen = choices.length === 1 ? choices[0] : await vscode.window.showQuickPick(choices, { title: 'What shall the monitor show?' });
    if (!chosen) {
      return;
    }
    if (chosen.args) {
      open(folder, path.dirname(editor.document.uri.fsPath), chosen.args);
      return;
    }
    const [picked] = (await vscode.window.showOpenDialog({
      title: 'A record, or the socket of a control', openLabel: 'Monitor',
    })) || [];
    if (picked) {
      open(folder, path.dirname(picked.fsPath), [picked.fsPath]);
    }
  };

  const command = (name, run) => vscode.commands.registerCommand(`plcc.${name}`, run);
  return command('monitor', choose);
}

module.exports = { register };
