textures/unknown
{
	surfaceparm nothing
	frobnicate 1 2 3
	cull sideways
	{
		map
		blendFunc GL_NOTHING
		rgbGen
		tcMod scroll 1
	}
}
}
textures/twice { { map a } }
textures/twice { { map b } }
textures/open
{
	{
		map "quoted name
	}
textures/next
{
	{
		map c /* never closed
	}
}
