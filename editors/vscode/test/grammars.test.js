// Colours the examples with the grammars and looks at the scopes that come out.

const test = require('node:test');
const assert = require('node:assert');
const fs = require('node:fs');
const path = require('node:path');
const oniguruma = require('vscode-oniguruma');
const { Registry, INITIAL, parseRawGrammar } = require('vscode-textmate');

const folder = path.resolve(__dirname, '..');
const examples = path.resolve(folder, '../../examples');
const manifest = require('../package.json');

const wasm = fs.readFileSync(require.resolve('vscode-oniguruma/release/onig.wasm')).buffer;
const registry = new Registry({
  onigLib: oniguruma.loadWASM(wasm).then(() => ({
    createOnigScanner: (patterns) => new oniguruma.OnigScanner(patterns),
    createOnigString: (text) => new oniguruma.OnigString(text),
  })),
  loadGrammar: async (scopeName) => {
    const grammar = manifest.contributes.grammars.find((one) => one.scopeName === scopeName);
    const file = path.join(folder, grammar.path);
    return parseRawGrammar(fs.readFileSync(file, 'utf8'), file);
  },
});

/** The tokens of each line of a text: their text and their innermost scope. */
async function tokens(scopeName, text) {
  const grammar = await registry.loadGrammar(scopeName);
  let state = INITIAL;
  return text.split(/\r?\n/).map((line) => {
    const result = grammar.tokenizeLine(line, state);
    state = result.ruleStack;
    return result.tokens.map(({ startIndex, endIndex, scopes }) => ({
      text: line.slice(startIndex, endIndex),
      scope: scopes.at(-1),
    }));
  });
}

/** The scopes of the parts of a line that are not blank, `TEXT scope`, without the language. */
async function line(scopeName, text) {
  const [found] = await tokens(scopeName, text);
  return found
    .filter((token) => token.text.trim())
    .map((token) => `${token.text.trim()} ${token.scope.replace(/\.[a-z]+$/, '')}`);
}

const files = [
  ['source.pmi', 'pmi/lathe.pmi'],
  ['source.pmi', 'pmi/touch.pmi'],
  ['source.nct', 'nct/sample.plc'],
  ['source.nct', 'nct/axrandom.plc'],
  ['source.pmac', 'pmac/mill.pmc'],
  ['source.pmac', 'pmac/mill-io.h'],
];

for (const [scopeName, file] of files) {
  test(`every part of ${file} has a colour`, async () => {
    const text = fs.readFileSync(path.join(examples, file), 'latin1');
    const lines = await tokens(scopeName, text);
    const plain = [];
    let coloured = 0;
    lines.forEach((found, number) => {
      for (const token of found) {
        if (!token.text.trim()) continue;
        if (token.scope === scopeName) plain.push(`${file}:${number + 1}: ${token.text}`);
        else coloured += 1;
      }
    });
    assert.deepStrictEqual(plain, []);
    assert.ok(coloured > 50);
  });
}

test('PMI: directives, executive variables, comments, texts', async () => {
  assert.deepStrictEqual(await line('source.pmi', 'IF (@IPL&/A[3]) ? COLD START'), [
    'IF keyword.control',
    '( punctuation',
    '@IPL variable.language.executive',
    '& keyword.operator',
    '/ keyword.operator',
    'A variable.other',
    '[ punctuation',
    '3 constant.numeric',
    '] punctuation',
    ') punctuation',
    '? COLD START comment.line.question-mark',
  ]);
  assert.deepStrictEqual(await line('source.pmi', '$TIMER'), ['$TIMER keyword.control.directive']);
  assert.deepStrictEqual(await line('source.pmi', 'EMERG=F'), [
    'EMERG variable.other',
    '= keyword.operator',
    'F constant.language.boolean',
  ]);
  const [text] = await line('source.pmi', '"WHY? #1"');
  assert.match(text, /string\.quoted\.double$/);
});

test('NCT: statements without blanks between them', async () => {
  assert.deepStrictEqual(await line('source.nct', '(V000ANI000) UF0113 LRP039 =2 C009 Z ;stop'), [
    '( punctuation',
    'V000 variable.other.line',
    'A keyword.operator.word',
    'N keyword.operator.word',
    'I000 variable.other.line',
    ') punctuation',
    'U keyword.other.set',
    'F0113 variable.other',
    'L keyword.other.accumulator',
    'RP039 variable.other.register',
    '= keyword.operator',
    '2 constant.numeric',
    'C keyword.control.jump',
    '009 entity.name.label',
    'Z keyword.control.condition',
    ';stop comment.line.semicolon',
  ]);
  const module = await tokens('source.nct', ':199\nSPINDLE ERROR,\n$\n:001');
  assert.strictEqual(module[1][0].scope, 'string.unquoted.text-module.nct');
  assert.strictEqual(module[3][0].scope, 'entity.name.function.module.nct');
});

test('PMAC: variables, definitions, commands', async () => {
  assert.deepStrictEqual(await line('source.pmac', 'M9->Y:$FFC2,8,8,U ; outputs'), [
    'M9 variable.language',
    '-> keyword.operator.definition',
    'Y storage.type.memory',
    ': punctuation',
    '$FFC2 constant.numeric.hex',
    ', punctuation',
    '8 constant.numeric',
    ', punctuation',
    '8 constant.numeric',
    ', punctuation',
    'U variable.other.constant',
    '; outputs comment.line.semicolon',
  ]);
  assert.deepStrictEqual(await line('source.pmac', 'IF (P1!>2) CMD"#1J+" ENAPLCC1'), [
    'IF keyword.control',
    '( punctuation',
    'P1 variable.language',
    '!> keyword.operator',
    '2 constant.numeric',
    ') punctuation',
    'CMD keyword.other.command',
    '" string.quoted.double',
    '#1J+ string.quoted.double',
    '" string.quoted.double',
    'ENA keyword.control.plc',
    'PLCC keyword.control.plc',
    '1 constant.numeric',
  ]);
});

test('problem matchers read what plcc prints', () => {
  const [text, json] = manifest.contributes.problemMatchers;
  const [first, second] = text.pattern.map((pattern) => new RegExp(pattern.regexp));
  assert.deepStrictEqual(first.exec('[PMI-31] Error: nothing is named REDY').slice(1), [
    'PMI-31', 'Error', 'nothing is named REDY',
  ]);
  assert.deepStrictEqual(second.exec('   ╭─[ pump.pmi:7:8 ]').slice(1), ['pump.pmi', '7', '8']);
  const object =
    '{"code":"PMI-W1","lint":"near-name","severity":"warning","message":"a \\"b\\"","file":"x.pmi","line":2,"column":5,"end_line":2,"end_column":6,"notes":[]}';
  assert.deepStrictEqual(new RegExp(json.pattern.regexp).exec(object).slice(1), [
    'PMI-W1', 'warning', 'a \\"b\\"', 'x.pmi', '2', '5', '2', '6',
  ]);
  const plain = object.replace('"lint":"near-name",', '');
  assert.strictEqual(new RegExp(json.pattern.regexp).exec(plain)[1], 'PMI-W1');
});

test('what the manifest names is there', () => {
  const { languages, grammars, commands, walkthroughs } = manifest.contributes;
  for (const file of [...languages.map((one) => one.configuration), ...grammars.map((one) => one.path)]) {
    JSON.parse(fs.readFileSync(path.join(folder, file), 'utf8'));
  }
  for (const { media } of walkthroughs.flatMap((one) => one.steps)) {
    assert.ok(fs.existsSync(path.join(folder, media.markdown)), media.markdown);
  }
  const code = ['extension.js', 'monitor.js', 'values.js'].map((name) => fs.readFileSync(path.join(folder, name), 'utf8')).join('\n');
  for (const { command } of commands) {
    assert.ok(code.includes(`command('${command.split('.')[1]}'`), command);
  }
});
