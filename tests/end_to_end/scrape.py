"""Reads what a daemon exposes for Prometheus."""

import re
import urllib.request

SERIES = re.compile(r"^([a-zA-Z_:][\w:]*)(?:\{(.*)\})? (\S+)$")
LABEL = re.compile(r'(\w+)="((?:[^"\\]|\\.)*)"')


class Scrape:
    """One scrape: families {name: type}, series {(name, ((label, value), ...)): value}."""

    def __init__(self, text):
        self.families, self.series = {}, {}
        for line in text.splitlines():
            if line.startswith("# TYPE "):
                name, kind = line.split()[2:]
                self.families[name] = kind
            elif line and not line.startswith("#"):
                name, labels, value = SERIES.match(line).groups()
                self.series[name, tuple(sorted(LABEL.findall(labels or "")))] = float(value)

    def value(self, name, **labels):
        """0 where there is no such series."""
        return self.series.get((name, tuple(sorted(labels.items()))), 0.0)

    def labels(self, name):
        """Names of all labels that any series of this name has."""
        return {label for series, labels in self.series if series == name for label, _ in labels}

    def names(self):
        return {name for name, _ in self.series}


def get(url, method="GET"):
    """(status, body) of a plain HTTP request."""
    request = urllib.request.Request(url, method=method)
    try:
        with urllib.request.urlopen(request, timeout=10) as answer:
            return answer.status, answer.read().decode()
    except urllib.error.HTTPError as error:
        return error.code, error.read().decode()


def scrape(daemon):
    status, text = get(daemon.metrics + "/metrics")
    assert status == 200, text
    return Scrape(text)
