-- Works on a program with `plcc lsp` in Neovim, as a user does, and writes what Neovim shows to a file, a line each.
local plcc, source, report = os.getenv('PLCC'), os.getenv('SOURCE'), os.getenv('REPORT')
local out = assert(io.open(report, 'w'))
local function say(...) out:write(table.concat({ ... }, ' '):gsub('\n', ' '), '\n') out:flush() end

vim.opt.swapfile = false
vim.cmd('edit ' .. source)
local client
local id = vim.lsp.start_client({
  name = 'plcc',
  cmd = { plcc, 'lsp' },
  root_dir = vim.fn.fnamemodify(source, ':h'),
  get_language_id = function() return 'pmi' end,
  on_init = function(it) client = it end,
})
vim.bo.filetype = 'pmi'
vim.lsp.buf_attach_client(0, id)
local patience = 60000
assert(vim.wait(patience, function() return client ~= nil and client.initialized end), 'the server does not start')

local function ask(method, params)
  local answer, problem = client.request_sync(method, params, patience, vim.api.nvim_get_current_buf())
  assert(answer and not answer.err, method .. ': ' .. vim.inspect(problem or answer))
  return answer.result
end

-- The parameters for the place of a text, a number of columns after its beginning.
local function at(text, columns)
  for row, line in ipairs(vim.api.nvim_buf_get_lines(0, 0, -1, false)) do
    local column = line:find(text, 1, true)
    if column then
      local position = { line = row - 1, character = column - 1 + (columns or 0) }
      return { textDocument = vim.lsp.util.make_text_document_params(), position = position }
    end
  end
  error('there is no ' .. text)
end

local function problems()
  return vim.diagnostic.get(0)
end

-- The problem, and the change that the server offers for it.
assert(vim.wait(patience, function() return #problems() > 0 end), 'no problems are shown')
for _, it in ipairs(problems()) do say('problem', it.lnum + 1, it.col + 1, it.message) end
local found = problems()[1]
local range = { start = { line = found.lnum, character = found.col }, ['end'] = { line = found.end_lnum, character = found.end_col } }
local actions = ask('textDocument/codeAction', {
  textDocument = vim.lsp.util.make_text_document_params(),
  range = range,
  context = { diagnostics = vim.lsp.diagnostic.get_line_diagnostics(0, found.lnum) },
})
for _, action in ipairs(actions) do say('action', action.title) end
vim.lsp.util.apply_workspace_edit(actions[1].edit, client.offset_encoding)
assert(vim.wait(patience, function() return #problems() == 0 end), 'the problem stays')
say('no problem', vim.api.nvim_buf_get_lines(0, found.lnum, found.lnum + 1, false)[1])

-- What is said of a name.
local hover = ask('textDocument/hover', at('DOOR &', 1))
say('hover', vim.lsp.util.convert_input_to_markdown_lines(hover.contents)[1])
local definition = ask('textDocument/definition', at('DOOR &', 1))
say('definition', (definition.range or definition[1].range).start.line + 1)
local references = at('DOOR &', 1)
references.context = { includeDeclaration = true }
for _, place in ipairs(ask('textDocument/references', references)) do say('reference', place.range.start.line + 1) end

-- A name is renamed everywhere.
local rename = at('DOOR &', 1)
rename.newName = 'GUARD'
vim.lsp.util.apply_workspace_edit(ask('textDocument/rename', rename), client.offset_encoding)
for _, line in ipairs(vim.api.nvim_buf_get_lines(0, 0, -1, false)) do
  if line:find('GUARD', 1, true) then say('renamed', line) end
end

-- Words are completed while they are typed.
vim.api.nvim_buf_set_lines(0, -1, -1, false, { 'EXTRA = GUA' })
local completion = ask('textDocument/completion', at('EXTRA = GUA', 11))
for _, item in ipairs(completion.items or completion) do
  if item.label == 'GUARD' then say('completion', item.label) end
end
vim.api.nvim_buf_set_lines(0, -2, -1, false, {})

-- The text is formatted where that is asked for.
local format = { textDocument = vim.lsp.util.make_text_document_params(), options = { tabSize = 2, insertSpaces = true } }
vim.lsp.util.apply_text_edits(ask('textDocument/formatting', format), 0, client.offset_encoding)
for _, line in ipairs(vim.api.nvim_buf_get_lines(0, 0, -1, false)) do
  if line:find('^ ') then say('formatted', line) end
end

for _, it in ipairs(ask('textDocument/documentSymbol', { textDocument = format.textDocument })) do say('symbol', it.name) end
client.stop()
assert(vim.wait(patience, function() return client.is_stopped() end), 'the server does not end')
say('ended')
