// Tasks: `plcc check` of the program in the editor and of all programs of a folder, and `plcc test` of its test scripts.

/** The languages of programs. */
const LANGUAGES = ['pmi', 'nct', 'pmac'];

/** The options of `plcc check` that say the same as the settings of the language server. */
function optionsOf(settings, language) {
  const options = settings.get('noLimits') ? ['--limits', 'none'] : [];
  for (const folder of settings.get('include') || []) {
    options.push('-I', folder);
  }
  if (settings.get('turbo') && language === 'pmac') {
    options.push('--controller', 'turbo');
  }
  return options;
}

/** Adds the tasks. `executable` gives the path of plcc for a folder. */
function register(vscode, executable) {
  /** A task that runs plcc with these arguments. */
  const task = (folder, name, definition, group) => {
    const scope = folder || vscode.TaskScope.Workspace;
    const options = folder && { cwd: folder.uri.fsPath };
    const process = new vscode.ProcessExecution(executable(folder), definition.args, options);
    const made = new vscode.Task(definition, scope, name, 'plcc', process, '$plcc');
    made.group = group;
    return made;
  };
  const provider = {
    provideTasks() {
      const editor = vscode.window.activeTextEditor;
      const settings = vscode.workspace.getConfiguration('plcc');
      const folders = vscode.workspace.workspaceFolders || [];
      const tasks = folders.map((folder) => {
        const args = ['test', '.'];
        return task(folder, 'test all scripts', { type: 'plcc', args }, vscode.TaskGroup.Test);
      });
      if (editor && LANGUAGES.includes(editor.document.languageId)) {
        const { uri, languageId } = editor.document;
        const args = ['check', '--dialect', languageId, ...optionsOf(settings, languageId), uri.fsPath];
        const folder = vscode.workspace.getWorkspaceFolder(uri);
        const name = `check ${vscode.workspace.asRelativePath(uri, false)}`;
        tasks.push(task(folder, name, { type: 'plcc', args }, vscode.TaskGroup.Build));
      }
      return tasks;
    },
    // A task of tasks.json, which says the arguments alone.
    resolveTask(asked) {
      const { definition, scope, name } = asked;
      const folder = typeof scope === 'object' ? scope : undefined;
      return Array.isArray(definition.args) ? task(folder, name, definition, asked.group) : undefined;
    },
  };
  return vscode.tasks.registerTaskProvider('plcc', provider);
}

module.exports = { optionsOf, register };
