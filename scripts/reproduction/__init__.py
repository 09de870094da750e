"""Papers reproduced: experiments that are kept as they are done, and a page that tells of them.

The machinery is here, a paper's content in a folder of its own.
"""
