# SPDX-FileCopyrightText: 2026 the dynfilter authors
# SPDX-License-Identifier: MIT

# Prepares a Markdown page of the repository for Doxygen (GNU sed -E -z). Doxygen knows neither the
# anchors that GitHub gives to headings nor files that are not pages, so links to those become text.

s/\[([^]]+)\]\(#[^) ]*\)/\1/g
s/(\]\([A-Za-z0-9_./-]+\.md)#[^) ]*\)/\1)/g

# Hide images and links to pages from the next rule.
s/!\[/!\x01/g
s/\]\(([A-Za-z0-9_./-]+\.md)\)/]\x02\1)/g
s/\[([^]]+)\]\((LICENSE|[A-Za-z0-9_-]*[./][A-Za-z0-9_./-]*)\)/\1/g
s/\x01/[/g
s/\x02/(/g
