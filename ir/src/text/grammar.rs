//! The grammar of the text form, over the [tokens](super::lex) of a whole text.
//!
//! What it gives is the text's structure. Names are not looked up yet: where a [`Value`],
//! [`Block`], [`Label`] or [`RegionId`] is mentioned, its number here is the *index of the token*
//! that names it, so that [`resolve`](super::resolve) finds both the name and its place.
//!
//! The grammar is not recursive, so no text can overflow the stack. In almost every place one token
//! decides how to go on, so the time is proportional to the length of the text.

use std::str::FromStr;

use chumsky::prelude::*;
use chumsky::primitive::select;
use plcc_abi::{HostFn, SourceLine, TrapCode, TrapSite};

use super::lex::{Token, unescaped};
use crate::func::LOCAL_BITS_NAME;
use crate::{
    Address, Args, BinaryOp, BitGroups, Block, BlockCall, ConvertOp, ExtractOp, Field, FloatCond,
    InstData, IntCond, Label, RegionId, SourceFile, Statement, StatementId, Terminator, Type,
    UnaryOp, Value,
};

/// What is at the top of the text.
pub(super) enum Item {
    /// `image`: the size in bytes.
    Image(u32),
    /// `region`: a region, whether `finite` is after it, for
    /// [`Module::finite_regions`](crate::Module::finite_regions), and whether `words24` does, for
    /// [`Module::word_regions`](crate::Module::word_regions).
    Region(plcc_abi::Region, bool, bool),
    /// `task`: its name, the label where it starts, and those of its resume points.
    Task(String, Label, Vec<Label>),
    /// `fn`.
    Func(Func),
    /// `trap_site`.
    TrapSite(TrapSite),
    /// `statement`.
    Statement(Statement),
    /// `file` with its lines.
    File(SourceFile),
}

/// A function.
pub(super) struct Func {
    pub(super) name: String,
    /// How many [local bits](crate::FuncData::local_bits) it has.
    pub(super) local_bits: u32,
    pub(super) blocks: Vec<BlockText>,
}

/// A block.
pub(super) struct BlockText {
    /// The name it has at its head.
    pub(super) head: Block,
    /// What is in parentheses after that.
    pub(super) params: Vec<Param>,
    /// Whether `cold` is before the colon.
    pub(super) cold: bool,
    /// Whether `small` is before the colon.
    pub(super) small: bool,
    pub(super) lines: Vec<Line>,
    pub(super) terminator: Terminator,
}

/// What the parentheses of a block's head hold.
pub(super) enum Param {
    /// A label that is at the block.
    Label(Label),
    /// A parameter.
    Value(Value, Type),
}

/// A line in a block.
pub(super) enum Line {
    /// `@…`: the statement that the following instructions belong to.
    Location(StatementId),
    /// An instruction with its result.
    Inst(Option<(Value, Type)>, InstData),
}

/// What is read: tokens, known by their indices.
pub(super) type Input<'t> = &'t [Token<'t>];
/// The errors: what was expected at which token.
type Extra<'t> = extra::Err<Rich<'t, Token<'t>>>;

/// A parser of tokens that gives an `O`: a short name for the bounds that chumsky needs.
pub(super) trait Grammar<'t, O>: Parser<'t, Input<'t>, O, Extra<'t>> + Clone {}
impl<'t, O, P: Parser<'t, Input<'t>, O, Extra<'t>> + Clone> Grammar<'t, O> for P {}

/// A parser of one word for which `read` gives a result. Error messages call it `what`.
fn word<'t, O: 't>(
    what: impl Into<String>,
    read: impl Fn(&'t str) -> Option<O> + Clone + 't,
) -> impl Grammar<'t, O> {
    let taken = move |token: Token<'t>| match token {
        Token::Word(word) => read(word),
        _ => None,
    };
    select(move |token, _| taken(token)).labelled(what.into())
}

/// A parser of exactly this word.
fn keyword<'t>(word: &'static str) -> impl Grammar<'t, Token<'t>> {
    just(Token::Word(word))
}

/// A parser of exactly this sign.
fn sign<'t>(sign: char) -> impl Grammar<'t, Token<'t>> {
    just(Token::Sign(sign))
}

fn end_of_line<'t>() -> impl Grammar<'t, Token<'t>> {
    just(Token::End)
}

/// A parser of text in quotes, escapes replaced.
fn quoted<'t>(what: &'static str) -> impl Grammar<'t, String> {
    let read = |token: Token<'t>| match token {
        Token::Quoted(text) => unescaped(text),
        _ => None,
    };
    select(move |token, _| read(token)).labelled(format!(
        "{what} in quotes, where `\\\\`, `\\r` or `\\{{hex}}` means a special character"
    ))
}

fn number<'t, N: FromStr + 't>(what: &'static str) -> impl Grammar<'t, N> {
    word(what, |word| word.parse().ok())
}

/// A parser of a name that is made of a prefix and a number, such as `v3`. It gives the index of
/// the token, not the number.
fn reference<'t>(prefix: &'static str, what: &str) -> impl Grammar<'t, u32> {
    word(format!("{what} (`{prefix}0`)"), move |word| number_in_name(prefix, word))
        .map_with(|_, place| token_index(place.span()))
}

/// The number in a name that is made of a prefix and a number; `None` if the word is not such a name.
pub(super) fn number_in_name(prefix: &str, word: &str) -> Option<u32> {
    word.strip_prefix(prefix)?.parse().ok()
}

fn token_index(span: SimpleSpan) -> u32 {
    u32::try_from(span.start).unwrap_or(u32::MAX)
}

fn value<'t>() -> impl Grammar<'t, Value> {
    reference("v", "a value").map(Value)
}

fn block<'t>() -> impl Grammar<'t, Block> {
    reference("block", "a block").map(Block)
}

fn label<'t>() -> impl Grammar<'t, Label> {
    reference("L", "a label").map(Label)
}

fn type_name<'t>() -> impl Grammar<'t, Type> {
    let names: Vec<_> = Type::ALL.iter().map(|ty| ty.name()).collect();
    word(format!("a type ({})", names.join(" ")), Type::from_name)
}

/// A parser of one of several words. Error messages list them all.
fn one_of_words<'t, T: Copy + 't>(
    what: &str,
    all: &[T],
    spelt: fn(T) -> &'static str,
    find: fn(&str) -> Option<T>,
) -> impl Grammar<'t, T> {
    let words: Vec<_> = all.iter().map(|&one| spelt(one)).collect();
    word(format!("{what} ({})", words.join(" ")), find)
}

/// The whole text.
pub(super) fn module<'t>() -> impl Grammar<'t, Vec<Item>> {
    let image = keyword("image").ignore_then(number("a size in bytes")).map(Item::Image);
    let items =
        choice((image, region(), task(), trap_site(), statement())).then_ignore(end_of_line());
    choice((items, function().map(Item::Func), file())).repeated().collect().then_ignore(end())
}

fn region<'t>() -> impl Grammar<'t, Item> {
    let name = word("the region's name", |word| Some(word.to_owned()));
    let offset = keyword("at").ignore_then(number("an offset in bytes"));
    let size = keyword("size").ignore_then(number("a size in bytes"));
    let bits = keyword("bits").or_not();
    let finite = keyword("finite").or_not();
    let words = keyword("words24").or_not();
    let place = keyword("region").ignore_then(name).then(offset).then(size);
    place.then(bits).then(finite).then(words).map(
        |(((((name, offset), size), bits), finite), words)| {
            let region = plcc_abi::Region { name, offset, size, bits: bits.is_some() };
            Item::Region(region, finite.is_some(), words.is_some())
        },
    )
}

fn task<'t>() -> impl Grammar<'t, Item> {
    let name = quoted("the task's name");
    let labels = label().separated_by(sign(',')).collect::<Vec<Label>>();
    let points = keyword("resume").ignore_then(labels.delimited_by(sign('['), sign(']'))).or_not();
    let task = keyword("task").ignore_then(name).then(label()).then(points);
    task.map(|((name, entry), points)| Item::Task(name, entry, points.unwrap_or_default()))
}

fn trap_site<'t>() -> impl Grammar<'t, Item> {
    let field = |word| keyword(word).ignore_then(number("a number"));
    keyword("trap_site")
        .ignore_then(trap_code())
        .then(field("file"))
        .then(field("line"))
        .then(field("array").or_not())
        .map(|(((code, file), line), array)| {
            Item::TrapSite(TrapSite { code, statement: SourceLine { file, line }, array })
        })
}

fn trap_code<'t>() -> impl Grammar<'t, TrapCode> {
    one_of_words("a code", TrapCode::ALL, TrapCode::name, TrapCode::from_name)
}

fn statement<'t>() -> impl Grammar<'t, Item> {
    let field = |word| keyword(word).ignore_then(number("a number"));
    keyword("statement")
        .ignore_then(field("file"))
        .then(field("line"))
        .then(field("from"))
        .then(field("to"))
        .map(|(((file, line), start), end)| Item::Statement(Statement { file, line, start, end }))
}

fn file<'t>() -> impl Grammar<'t, Item> {
    let read = |token: Token<'t>| match token {
        Token::Line(text) => unescaped(text),
        _ => None,
    };
    let line = select(move |token, _| read(token))
        .labelled("a line of text after `|`, where a backslash precedes `\\`, `r` or `{hex}`");
    let lines = line.repeated().collect::<Vec<_>>();
    let name = keyword("file").ignore_then(quoted("the file's name")).then_ignore(end_of_line());
    name.then(lines).map(|(name, lines)| Item::File(SourceFile { name, text: lines.join("\n") }))
}

fn function<'t>() -> impl Grammar<'t, Func> {
    let name = quoted("the function's name");
    let local_bits = keyword(LOCAL_BITS_NAME).ignore_then(number("how many there are")).or_not();
    let head = keyword("fn").ignore_then(name).then(local_bits);
    let head = head.then_ignore(sign('{')).then_ignore(end_of_line());
    let foot = sign('}').then_ignore(end_of_line());
    let blocks = block_text().repeated().collect();
    head.then(blocks).then_ignore(foot).map(|((name, local_bits), blocks)| Func {
        name,
        local_bits: local_bits.unwrap_or(0),
        blocks,
    })
}

fn block_text<'t>() -> impl Grammar<'t, BlockText> {
    let value = value().then_ignore(sign(':')).then(type_name());
    let param = choice((label().map(Param::Label), value.map(|(v, ty)| Param::Value(v, ty))));
    let list = param.separated_by(sign(',')).at_least(1).collect::<Vec<_>>();
    let params = list.delimited_by(sign('('), sign(')')).repeated().collect::<Vec<_>>();
    let cold = keyword("cold").or_not().map(|word| word.is_some());
    let small = keyword("small").or_not().map(|word| word.is_some());
    let marks = cold.then(small);
    let head = block().then(params).then(marks).then_ignore(sign(':')).then_ignore(end_of_line());
    let lines = line().then_ignore(end_of_line()).repeated().collect();
    head.then(lines).then(terminator().then_ignore(end_of_line())).map(
        |((((head, params), (cold, small)), lines), terminator)| {
            let params = params.into_iter().flatten().collect();
            BlockText { head, params, cold, small, lines, terminator }
        },
    )
}

fn line<'t>() -> impl Grammar<'t, Line> {
    let location = word("a statement (`@0`, `@none`)", |word| match word {
        "@none" => Some(StatementId::NONE),
        _ => number_in_name("@", word).map(StatementId),
    });
    let result = value().then_ignore(sign(':')).then(type_name()).then_ignore(sign('='));
    let with_result = result
        .then(choice((operation(), host_call())).labelled("an instruction with a result"))
        .map(|((value, ty), data)| Line::Inst(Some((value, ty)), with_type(data, ty)));
    let store = keyword("store").ignore_then(address()).then_ignore(sign(',')).then(self::value());
    let store = store.map(|(at, value)| InstData::Store { at, value });
    let unpack = keyword("unpack").ignore_then(self::value()).then_ignore(sign(','));
    let unpack = unpack.then(bit_groups()).map(|(word, to)| InstData::Unpack { word, to });
    let alone = choice((store, unpack, host_call())).map(|data| Line::Inst(None, data));
    choice((with_result, location.map(Line::Location), alone)).labelled("an instruction")
}

/// Puts the type of the result into an instruction that needs it. The text has it before the
/// instruction.
fn with_type(mut data: InstData, result: Type) -> InstData {
    match &mut data {
        InstData::Iconst { ty, .. } | InstData::Load { ty, .. } => *ty = result,
        InstData::Convert { to, .. } => *to = result,
        _ => {}
    }
    data
}

/// Stands for the type until [`with_type`] puts the right one in.
const PLACEHOLDER: Type = Type::I1;

/// An instruction with a result, but for calls of the host.
fn operation<'t>() -> impl Grammar<'t, InstData> {
    let pair = || value().then_ignore(sign(',')).then(value()).map(|(a, b)| [a, b]);
    let unary = word("", UnaryOp::from_name).then(value());
    let binary = word("", BinaryOp::from_name).then(pair());
    let convert = word("", ConvertOp::from_name).then(value());
    let iconst = keyword("iconst").ignore_then(number("an integer of 64 bits"));
    let fconst = keyword("fconst").ignore_then(word("a finite number, or bits (`0x0`)", double));
    let ints = one_of_words("a comparison", IntCond::ALL, IntCond::name, IntCond::from_name);
    let icmp = keyword("icmp").ignore_then(ints).then(pair());
    let floats =
        one_of_words("a comparison", FloatCond::ALL, FloatCond::name, FloatCond::from_name);
    let fcmp = keyword("fcmp").ignore_then(floats).then(pair());
    let select = keyword("select").ignore_then(value()).then_ignore(sign(',')).then(pair());
    let field = || {
        let first = sign(',').ignore_then(number("the number of the lowest bit"));
        first.then(sign(',').ignore_then(number("how many bits there are")))
    };
    let field = || field().map(|(first, width)| Field { first, width });
    let bit = keyword("bit").ignore_then(value());
    let bit = bit.then(sign(',').ignore_then(number("the number of a bit")));
    let extract = word("", ExtractOp::from_name).then(value()).then(field());
    let insert = keyword("insert").ignore_then(pair()).then(field());
    let load = keyword("load").ignore_then(address());
    let pack = keyword("pack").ignore_then(bit_groups());
    let is_late = keyword("is_late").map(|_| InstData::IsLate);
    choice((
        load.map(|at| InstData::Load { ty: PLACEHOLDER, at }),
        binary.map(|(op, args)| InstData::Binary { op, args }),
        iconst.map(|value| InstData::Iconst { ty: PLACEHOLDER, value }),
        convert.map(|(op, arg)| InstData::Convert { op, to: PLACEHOLDER, arg }),
        unary.map(|(op, arg)| InstData::Unary { op, arg }),
        icmp.map(|(cond, args)| InstData::Icmp { cond, args }),
        fconst.map(|bits| InstData::Fconst { bits }),
        fcmp.map(|(cond, args)| InstData::Fcmp { cond, args }),
        select.map(|(cond, args)| InstData::Select { cond, args }),
        pack.map(|from| InstData::Pack { from }),
        bit.map(|(arg, number)| InstData::Bit { arg, number }),
        extract.map(|((op, arg), field)| InstData::Extract { op, arg, field }),
        insert.map(|(args, field)| InstData::Insert { args, field }),
        is_late,
    ))
}

/// The local bits of groups of eight bits: `local_bits:24[0, 2]`.
fn bit_groups<'t>() -> impl Grammar<'t, BitGroups> {
    let first = sign(':').ignore_then(number("the number of a local bit"));
    let group = word("a group of eight bits (0 to 3)", |word| {
        word.parse().ok().filter(|group| *group < BitGroups::COUNT)
    });
    let groups = group.separated_by(sign(',')).at_least(1).collect::<Vec<u32>>();
    let groups = groups.delimited_by(sign('['), sign(']'));
    keyword(LOCAL_BITS_NAME).ignore_then(first).then(groups).map(|(first, groups)| {
        let groups = groups.into_iter().fold(0, |groups, group| groups | 1 << group);
        BitGroups { first, groups }
    })
}

/// A double's bits.
fn double(word: &str) -> Option<u64> {
    match word.strip_prefix("0x") {
        Some(digits) => u64::from_str_radix(digits, 16).ok(),
        None => word.parse().ok().filter(|number: &f64| number.is_finite()).map(f64::to_bits),
    }
}

fn host_call<'t>() -> impl Grammar<'t, InstData> {
    let function = word("a function of the host", HostFn::from_name);
    let args = value().separated_by(sign(',')).at_most(4).collect::<Vec<_>>();
    let args = args.delimited_by(sign('('), sign(')'));
    keyword("hostcall").ignore_then(function).then(args).map(|(function, args)| {
        // There are four at most, so they have room.
        let args = Args::new(&args).unwrap_or_default();
        InstData::HostCall { function, args }
    })
}

fn address<'t>() -> impl Grammar<'t, Address> {
    let region =
        word("a region's name", Some).map_with(|_, place| RegionId(token_index(place.span())));
    let element = value()
        .then_ignore(sign('*'))
        .then(number("a distance in bytes"))
        .then_ignore(sign(','))
        .then(number("a number of elements"))
        .delimited_by(sign('['), sign(']'));
    let offset = sign(':').ignore_then(number("an offset in bytes"));
    let place = region.then(offset).then(element.or_not());
    keyword("volatile").or_not().then(place).map(|(volatile, ((region, offset), element))| {
        let at = match element {
            Some(((value, scale), count)) => Address::indexed(region, offset, value, scale, count),
            None => Address::fixed(region, offset),
        };
        if volatile.is_some() { at.volatile() } else { at }
    })
}

fn terminator<'t>() -> impl Grammar<'t, Terminator> {
    let args = value().separated_by(sign(',')).collect::<Vec<_>>();
    let args = args.delimited_by(sign('('), sign(')')).or_not();
    let call =
        block().then(args).map(|(block, args)| BlockCall { block, args: args.unwrap_or_default() });
    let comma = || sign(',');
    let jump = keyword("jump").ignore_then(call.clone()).map(Terminator::Jump);
    let brif = keyword("brif")
        .ignore_then(value())
        .then(comma().ignore_then(call.clone()))
        .then(comma().ignore_then(call))
        .map(|((cond, then), otherwise)| Terminator::Brif { cond, then, otherwise });
    let targets = block().separated_by(sign(',')).collect::<Vec<_>>();
    let switch = keyword("switch")
        .ignore_then(value())
        .then(comma().ignore_then(targets.delimited_by(sign('['), sign(']'))))
        .then(comma().ignore_then(block()))
        .map(|((arg, targets), default)| Terminator::Switch { arg, targets, default });
    let trap_at = keyword("trap_at")
        .ignore_then(value())
        .then(comma().ignore_then(value()))
        .map(|(site, index)| Terminator::TrapAt { site, index });
    choice((
        jump,
        brif,
        keyword("return").to(Terminator::Return),
        keyword("goto").ignore_then(label()).map(Terminator::Goto),
        switch,
        keyword("goto_indirect").ignore_then(value()).map(Terminator::GotoIndirect),
        keyword("suspend").ignore_then(label()).map(Terminator::Suspend),
        keyword("trap").ignore_then(trap_code()).map(Terminator::Trap),
        trap_at,
    ))
    .labelled("a terminator (`jump`, `return` and the like)")
}
