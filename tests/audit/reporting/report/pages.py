"""What a page refers to, told by an HTML parser and not by looking for words."""

import re
from html.parser import HTMLParser

_REFERENCES = ("src", "href", "xlink:href", "action", "data", "poster", "srcset", "background", "formaction")


class Page(HTMLParser):
    """`tags` in order, `references` to anything by any attribute or style sheet, and the `text` that is shown."""

    def __init__(self, html):
        super().__init__()
        self.tags, self.references, self.text, self.handlers = [], [], "", []
        self._in_style = False
        self.feed(html)
        self.close()

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        self._in_style = tag == "style"
        for name, value in attrs:
            if name in _REFERENCES:
                self.references.append(value)
            if name.startswith("on"):
                self.handlers.append(name)
            self.references += re.findall(r"url\(([^)]*)\)", value or "")

    def handle_endtag(self, tag):
        self._in_style = False

    def handle_data(self, data):
        if self._in_style:
            self.references += re.findall(r"url\(([^)]*)\)|@import\s+(\S+)", data)
        else:
            self.text += data

    @property
    def outside(self):
        """References that are neither data in the page nor places in it."""
        return [
            reference for reference in self.references if not str(reference).strip("'\" ").startswith(("#", "data:"))
        ]
