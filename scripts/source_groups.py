#!/usr/bin/env python3
"""scripts/source_groups.py FILE.cc ...: the sources in groups that compile as one, a group a line; for clang-tidy and for
builds whose time goes into headers. Sources in a group share no name of their own, by their looks."""
import os, re, sys

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
LARGEST_GROUP = 12
OPEN_GROUPS = 16  # a source goes into the first of so many that shares no name with it


def names(file):
    """What a source names for itself alone (by its looks, which may be wrong), and what it draws in by `using`."""
    text = open(os.path.join(ROOT, file)).read()
    own = set(re.findall(r'^TEST\w*\((\w+, *\w+)', text, re.M))
    own |= set(re.findall(r'^(?:struct|class|enum class|using) (\w+)\b(?: =| \{| :|;| final)', text, re.M))
    own |= set(re.findall(r'^(?!TEST|INSTANTIATE|namespace|using|template class)[\w:].*?([\w:~]+)(?:\(|\{| = |;$)', text, re.M))
    own |= set(re.findall(r'^#define (\w+)|^template class (\w+)', text, re.M))
    return own, set(re.findall(r'^using [\w:]+::(\w+);', text, re.M))


def testing_means(file):
    """The namespaces in which `testing::`, where a source says it, may be looked for before GoogleTest's."""
    text = open(os.path.join(ROOT, file)).read()
    if not re.search(r'(?<![:\w])testing::', text):
        return ''
    headers = re.findall(r'^#include "(tests/.*)"', text, re.M)
    texts = [text, *(open(os.path.join(ROOT, header)).read() for header in headers)]
    return ' '.join(sorted({'GoogleTest', *re.findall(r'^namespace ([\w:]*::testing) \{', '\n'.join(texts), re.M)}))


def compiled_often(file):
    """Highway includes a source with kernels once for each instruction set, by its own name."""
    return 'foreach_target.h' in open(os.path.join(ROOT, file)).read()


def checks_of(file):
    """The top directory, where that has checks of its own; else nothing."""
    top = file.split('/')[0]
    return top if os.path.exists(os.path.join(ROOT, top, '.clang-tidy')) else ''


def grouped(files):
    kinds = {file: (checks_of(file), testing_means(file)) for file in files if not compiled_often(file)}
    alike = [[file for file in kinds if kinds[file] == kind] for kind in sorted(set(kinds.values()))]
    alone = [[file] for file in files if file not in kinds]
    return alone + [group for some in alike for group in without_clashes(some)]


def without_clashes(files):
    groups = []
    for file in sorted(files):
        own, used = names(file)
        for group in [group for group in groups if len(group['files']) < LARGEST_GROUP][-OPEN_GROUPS:]:
            if not own & (group['own'] | group['used']) and not used & group['own']:
                break
        else:
            group = {'files': [], 'own': set(), 'used': set()}
            groups.append(group)
        group['files'].append(file)
        group['own'] |= own
        group['used'] |= used
    return [group['files'] for group in groups]


if __name__ == '__main__':
    for group in grouped(sys.argv[1:]):
        print(' '.join(group))
