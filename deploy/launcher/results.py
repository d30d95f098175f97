"""The table that ends a flight."""

import json


def passed(metrics):
    criteria = metrics.get("criteria", {})
    return bool(criteria) and all(criteria.values())


def table(metrics):
    """One line per criterion: its name, its figure where the metrics hold one, and the verdict; then
    what the log lost."""
    lines = [f"{'criterion':<28} {'figure':>10}  verdict"]
    for name, holds in metrics.get("criteria", {}).items():
        value = metrics.get(name)
        figure = f"{value:.4g}" if isinstance(value, (int, float)) else ""
        lines.append(f"{name:<28} {figure:>10}  {'passed' if holds else 'FAILED'}")
    if len(lines) == 1:
        lines.append("the scenario names no criteria")
    return "\n".join(lines + metrics.get("losses", []))


def load(path):
    with open(path, encoding="utf-8") as file:
        return json.load(file)
