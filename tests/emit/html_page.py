"""A page of HTML as browsers and readers of XML see it, and what holds of every page."""

from collections import Counter
from html.parser import HTMLParser
from xml.etree import ElementTree as ET

from tests.notation.mathml_reader import assert_is_core

_XHTML = "{http://www.w3.org/1999/xhtml}"
_MATHML = "{http://www.w3.org/1998/Math/MathML}"
_SVG = "{http://www.w3.org/2000/svg}"

#: Elements that have no end tag in HTML.
_VOID = {"meta"}

#: Elements of HTML that pages have, each with its attributes.
_ELEMENTS = {
    "html": {"lang", "{http://www.w3.org/XML/1998/namespace}lang"},
    "meta": {"charset", "name", "content"},
    "section": {"id"},
    "p": {"class"},
    "div": {"class"},
    "th": {"scope", "class"},
    "td": {"class"},
    **dict.fromkeys(("head", "title", "style", "body", "main", "h1", "h2", "figure", "code"), ()),
    **dict.fromkeys(("ul", "li", "table", "thead", "tbody", "tr", "dl", "dt", "dd", "pre"), ()),
}


class _Tags(HTMLParser):
    """Start tags and texts in the order of the page; end tags are those of the elements."""

    def __init__(self):
        super().__init__(convert_charrefs=True)
        self.open, self.seen, self.text = [], [], ""

    def handle_starttag(self, tag, attrs):
        self.seen.append(tag)
        if tag not in _VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        """In HTML, only void elements and those of MathML and SVG end where they begin."""
        self.seen.append(tag)
        assert tag in _VOID or {"math", "svg"} & set(self.open), tag

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text += data

    def handle_comment(self, data):
        raise AssertionError(data)


def parsed_page(text):
    """The root of a page that HTML and XML read alike, checked for what holds of every page."""
    root, tags = ET.fromstring(text.encode()), _Tags()
    tags.feed(text)
    tags.close()
    assert text.startswith("<!DOCTYPE html>\n<html ")
    assert not tags.open
    names = [element.tag.partition("}")[2] for element in root.iter()]
    assert tags.seen == [name.lower() for name in names]
    assert tags.text.strip() == "".join(root.itertext()).strip()
    for element in root.iter():
        _assert_known(element)
    ids = Counter(element.get("id") for element in root.iter() if element.get("id"))
    assert set(ids.values()) <= {1}
    headings = [e.tag.removeprefix(_XHTML) for e in root.iter() if e.tag in _heads()]
    assert headings[0] == "h1"
    assert set(headings[1:]) <= {"h2"}
    return root


def _heads():
    return {f"{_XHTML}h{level}" for level in range(1, 7)}


def _assert_known(element):
    if element.tag.startswith(_XHTML):
        assert set(element.attrib) <= set(_ELEMENTS[element.tag.removeprefix(_XHTML)])
    elif element.tag == f"{_MATHML}math":
        assert_is_core(without_namespaces(element))
    else:
        assert element.tag.startswith((_MATHML, _SVG))


def without_namespaces(element):
    """A copy of an element, whose names are those of its language alone."""
    copy = ET.Element(element.tag.partition("}")[2], element.attrib)
    copy.text, copy.tail = element.text, element.tail
    copy.extend(map(without_namespaces, element))
    return copy


def found(root, name):
    """Elements of HTML of a name."""
    return list(root.iter(f"{_XHTML}{name}"))


def formulas(root):
    """Formulas, without their namespace."""
    return [without_namespaces(e) for e in root.iter(f"{_MATHML}math")]


def text_of(element):
    return "".join(element.itertext())
